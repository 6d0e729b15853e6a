// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>

#include "core/result.hpp"

namespace orbitfuse::farm {

/// Device error naming the folder when its file system does not answer within the time: a dead
/// mount would hold this program for ever, and no signal frees it. A child asks and is left behind.
Status answers(const std::filesystem::path& folder, double within_s = 10);
/// The same with another question than stat(2).
Status answers(const std::filesystem::path& folder, double within_s,
               const std::function<void()>& ask);

}  // namespace orbitfuse::farm
