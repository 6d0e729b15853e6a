// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace orbitfuse::doctor {

/// First line of a kernel file, nothing when it can't be read.
std::optional<std::string> line_of(const std::filesystem::path& file);
/// Its number, decimal or 0x...; nothing when it isn't one.
std::optional<long long> number_of(const std::filesystem::path& file);
/// Names in a folder, sorted; empty when there is none.
std::vector<std::string> names_in(const std::filesystem::path& folder);

}  // namespace orbitfuse::doctor
