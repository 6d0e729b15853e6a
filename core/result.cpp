// SPDX-License-Identifier: BSD-3-Clause
#include "core/result.hpp"

namespace orbitfuse {

std::string Error::message() const {
  std::string text = where;
  if (!found.empty()) text += (text.empty() ? "" : ": ") + found;
  if (!remedy.empty()) text += (text.empty() ? "" : "; ") + remedy;
  return text;
}

}  // namespace orbitfuse
