// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "core/result.hpp"
#include "core/system/parallel.hpp"

namespace orbitfuse {

/// Tasks that may fail, such as the encoding and writing of several pictures: all are run, side by
/// side. The error is that of the first that failed, in their order.
inline Status side_by_side(const std::vector<std::function<Status()>>& tasks) {
  std::vector<Status> done(tasks.size());
  parallel_for(static_cast<int>(tasks.size()), [&](int i) {
    done[static_cast<std::size_t>(i)] = tasks[static_cast<std::size_t>(i)]();
  });
  for (Status& status : done)
    if (!status) return std::move(status);
  return {};
}

}  // namespace orbitfuse
