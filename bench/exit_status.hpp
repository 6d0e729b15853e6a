// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdio>

#include "core/result.hpp"

namespace orbitfuse {

/// What main() of a benchmark returns: 0, or 1 and the error on stderr.
inline int exit_status(const Status& status) {
  if (status) return 0;
  std::fprintf(stderr, "error: %s\n", status.error().message().c_str());
  return 1;
}

}  // namespace orbitfuse
