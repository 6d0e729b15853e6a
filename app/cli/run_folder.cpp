// SPDX-License-Identifier: BSD-3-Clause
#include "app/cli/run_folder.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <set>

#include "app/cli/run_stages.hpp"
#include "app/pipeline/stage_record.hpp"
#include "app/stages/build_stages.hpp"
#include "core/modality.hpp"
#include "core/nested_text.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::cli {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;

/// Results without run.json are no session, and making one is no remedy.
Status check_no_lost_record(const std::string& folder) {
  std::error_code unreadable;
  if (fs::exists(fs::path(folder) / "manifest.jsonl", unreadable) ||
      pipeline::finished_stages(folder, stages::stage_names()).empty())
    return {};
  return fail(ErrorKind::input, folder, "results of a run, but no run.json that names its session",
              "name the session, with --out " + folder);
}

/// Of any verb: not all take a session.
std::string name_it_again(const std::string& folder) {
  return "run again, naming the session: orbitfuse run SESSION --out " + folder;
}

std::string absolute_name(const std::string& folder) {
  return fs::absolute(folder).lexically_normal().string();
}

enum class Alike { yes, no, unknown };

/// Whether the poses in `out` were made of a session's frames, by their own records.
Alike made_of_same(const fs::path& out, const std::set<std::string>& finished,
                   const ContentOf& content_of) {
  bool known = false, unread = false;
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    const std::string stage = "poses_" + std::string(name(modality));
    if (!finished.contains(stage)) continue;
    const auto record = pipeline::read_stage_record(out / stage);
    const std::string content = record ? content_of(modality) : std::string();
    if (content.empty()) {
      unread = true;
      continue;
    }
    const auto outside = record->inputs.find("outside");
    if (outside == record->inputs.end() || outside->second != content) return Alike::no;
    known = true;
  }
  return known && !unread ? Alike::yes : Alike::unknown;
}

}  // namespace

bool lies_among_frames(const fs::path& out, const fs::path& session) {
  std::error_code unreadable;  // whoever opens the session says why
  if (!fs::exists(session / "manifest.jsonl", unreadable)) return false;
  const fs::path inside = fs::weakly_canonical(out, unreadable)
                              .lexically_relative(fs::weakly_canonical(session, unreadable));
  return inside == "." || (!inside.empty() && (*inside.begin() == name(Modality::visible) ||
                                               *inside.begin() == name(Modality::thermal)));
}

Result<json> earlier_run(const std::string& folder) {
  const fs::path record = fs::path(folder) / run_file;
  std::error_code unreadable;  // whoever opens the session says why
  if (folder.empty() || !fs::exists(record, unreadable)) return json();
  ORBITFUSE_ASSIGN(const std::string text, read_file(record));
  json run = parse_json(text);
  if (run.is_discarded())
    return fail(ErrorKind::input, record.string(), json_fault(text), name_it_again(folder));
  if (!run.is_object() || !run.contains("session") || !run["session"].is_string())
    return fail(ErrorKind::input, record.string(), "no session named in it", name_it_again(folder));
  return run;
}

std::optional<std::string> other_results(const std::string& out, const Session& session,
                                         const ContentOf& content_of) {
  const auto run = earlier_run(out);
  const bool told = run && !run->is_null();
  std::error_code gone;
  if (told && (is_of(*run, session) ||
               fs::equivalent((*run)["session"].get<std::string>(), session.folder, gone)))
    return std::nullopt;
  const auto finished = pipeline::finished_stages(out, stages::stage_names());
  if (finished.empty()) return std::nullopt;
  // A run of an earlier version, which noted no id; the same files, imported again; or run.json is
  // lost or damaged.
  const Alike alike = made_of_same(out, finished, content_of);
  if (alike == Alike::no || (told && alike == Alike::unknown))
    return told ? "holds results of another session, " + (*run)["session"].get<std::string>()
                : "holds results of other frames than this session's, and no run.json that names "
                  "theirs";
  return std::nullopt;
}

bool is_of(const json& run, const Session& session) {
  if (!run.is_object()) return false;
  const auto same = [&](const char* key, const std::string& mine) {
    const auto found = run.find(key);
    return found != run.end() && !mine.empty() && *found == mine;
  };
  return same("session", absolute_name(session.folder.string())) || same("session_id", session.id);
}

Result<std::optional<std::uint64_t>> read_earlier_options(const std::string& folder,
                                                          config::Settings& settings) {
  ORBITFUSE_ASSIGN(const json run, earlier_run(folder));
  if (run.is_null()) return std::nullopt;
  const std::string file = (fs::path(folder) / run_file).string();
  const auto broken = [&](const char* key, const char* wanted) {
    return fail(ErrorKind::input, file, fmt::format("{} = {}", key, run[key].dump()),
                fmt::format("it must be {}; or {}", wanted, name_it_again(folder)));
  };
  if (run.contains("config")) {
    if (!run["config"].is_object()) return broken("config", "a table of settings");
    ORBITFUSE_TRY(settings.read_json(run["config"], file).map_error([](Error error) {
      error.kind = ErrorKind::input;  // the user didn't write it
      return error;
    }));
  }
  if (!run.contains("seed")) return std::nullopt;
  if (!run["seed"].is_number_unsigned()) return broken("seed", "an integer of at least 0");
  return run["seed"].get<std::uint64_t>();
}

Status resolve(StageFolders& folders) {
  if (folders.session.empty())
    return fail(ErrorKind::usage, "session", "none given",
                "name a session folder, e.g. replay_data/car");
  ORBITFUSE_ASSIGN(const json run, earlier_run(folders.session));
  // run.json and the records of the stages are JSON and name both folders.
  for (const std::string& folder : {folders.session, folders.out}) {
    if (!config::is_utf8(folder))
      return fail(ErrorKind::usage, folder, "its name is not UTF-8", "rename the folder");
  }
  if (run.is_null()) ORBITFUSE_TRY(check_no_lost_record(folders.session));
  if (!run.is_null()) {
    const std::string given = folders.session;
    if (folders.out == StageFolders{}.out) folders.out = given;
    folders.session = run["session"];
    std::error_code unreadable;  // whoever opens the session says why
    if (!fs::exists(folders.session, unreadable) && !unreadable)
      return fail(ErrorKind::input, given,
                  "its session " + folders.session + " is not there any more",
                  "bring it back, or name the session where it is now, with --out " + folders.out);
  }
  if (lies_among_frames(folders.out, folders.session))
    return fail(ErrorKind::usage, "--out " + folders.out, "holds the session itself",
                "choose another folder");
  return {};
}

}  // namespace orbitfuse::cli
