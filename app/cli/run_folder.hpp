// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
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

/// The session that the results in `out` are of, where it is another than `session`.
std::optional<std::string> other_session(const std::string& out, const std::string& session);

/// The same where stages are finished there and the sessions differ, not their folders alone: one
/// that was moved or copied since, or imported again from the same files, is none other.
std::optional<std::string> other_results(const std::string& out, const stages::SessionInput& input);

/// run.json tells of this session, by its folder or its id.
bool is_of(const nlohmann::json& run, const Session& session);

/// `out` is the session's own folder, or lies in one for its images: what is written there would be
/// an image of it.
bool lies_among_frames(const std::filesystem::path& out, const std::filesystem::path& session);

}  // namespace orbitfuse::cli
