// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "core/result.hpp"

namespace orbitfuse::pipeline {

/// The folders that stages work in and leave. Errors: device (permissions, a full disk).
Status make_folder(const std::filesystem::path& folder);
Status remove_tree(const std::filesystem::path& folder);

/// Puts `from` in the place of `to`: one exchange, so that a crash leaves the old or the new.
Status replace_folder(const std::filesystem::path& from, const std::filesystem::path& to);

/// Whether a stage's result, or what it made before it failed, may take its place in `out`: what no
/// run left there may be anything, and names like "report" and "depth" are common. Error: usage.
Status check_places(const std::filesystem::path& out, const std::string& stage);

/// What a stage leaves that misses its quality gate: <stage>.failed.
std::filesystem::path failed_folder(const std::filesystem::path& out, const std::string& stage);
/// Why the stage failed that left that folder; empty where none is there, "?" without its mark.
std::string why_failed(const std::filesystem::path& out, const std::string& stage);
/// Puts `from` there with a mark that says why, and the place into the error's remedy; that it
/// can't be kept is no further error.
void keep_failed(const std::filesystem::path& from, const std::filesystem::path& out,
                 const std::string& stage, Error& error);

}  // namespace orbitfuse::pipeline
