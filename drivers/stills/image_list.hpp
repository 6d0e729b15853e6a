// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace orbitfuse {

/// Image files named by the paths: files as given, folders without their sub-folders. In natural
/// name order ("9.jpg" before "10.jpg"). Input error when a path is missing or has no images.
Result<std::vector<std::filesystem::path>> list_images(const std::vector<std::filesystem::path>& paths);

/// Natural order: digit runs compare as numbers.
bool natural_less(const std::string& a, const std::string& b);

}  // namespace orbitfuse
