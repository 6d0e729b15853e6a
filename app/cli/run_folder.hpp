// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "app/stages/session_input.hpp"
#include "core/result.hpp"
#include "core/session/session.hpp"

// What the --out folder of an earlier run says of itself.
namespace orbitfuse::cli {

inline constexpr const char* run_file = "run.json";

/// run.json of an earlier run's folder, which names a session; null when there is none.
Result<nlohmann::json> earlier_run(const std::string& folder);

/// Hash of a modality's frames and devices in a session (stages::SessionInput::content); empty:
/// not to be had.
using ContentOf = std::function<std::string(Modality)>;

/// Where stages are finished in `out` of another session: "holds results of another session, ...".
/// One that was moved or copied since, or imported again from the same files, is none other; where
/// no run.json tells, what its poses were made of does.
std::optional<std::string> other_results(const std::string& out, const Session& session,
                                         const ContentOf& content_of);

/// run.json tells of this session, by its folder or its id.
bool is_of(const nlohmann::json& run, const Session& session);

/// `out` is the session's own folder, or lies in one for its images: what is written there would be
/// an image of it.
bool lies_among_frames(const std::filesystem::path& out, const std::filesystem::path& session);

}  // namespace orbitfuse::cli
