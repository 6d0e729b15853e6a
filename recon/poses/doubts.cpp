// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/doubts.hpp"

#include <algorithm>
#include <utility>

namespace orbitfuse {

void add_doubt(DoubtfulView view, std::vector<DoubtfulView>& doubtful) {
  const auto is_it = [&](const DoubtfulView& known) { return known.name == view.name; };
  if (std::none_of(doubtful.begin(), doubtful.end(), is_it)) doubtful.push_back(std::move(view));
}

}  // namespace orbitfuse
