// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "core/result.hpp"

namespace orbitfuse::pipeline {

/// The folders that stages work in and leave. Errors: device (permissions, a full disk).
Status make_folder(const std::filesystem::path& folder);
Status remove_tree(const std::filesystem::path& folder);

/// Puts `from` in the place of `to`: one exchange, so that a crash leaves the old or the new.
Status replace_folder(const std::filesystem::path& from, const std::filesystem::path& to);

/// Whether a stage's result may take this place: what no stage left there may be anything, and
/// names like "report" and "depth" are common. Error: usage.
Status check_place(const std::filesystem::path& folder);

}  // namespace orbitfuse::pipeline
