// SPDX-License-Identifier: BSD-3-Clause
#include "app/cli/run_stages.hpp"

#include <fmt/format.h>

#include "app/pipeline/runner.hpp"
#include "app/planning/machine_speed.hpp"
#include "app/planning/run_planner.hpp"
#include "app/stages/build_stages.hpp"
#include "core/modality.hpp"
#include "core/nested_text.hpp"
#include "core/system/clock.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::cli {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using pipeline::StageState;
using pipeline::StageStatus;

constexpr const char* run_file = "run.json";

json status_json(const StageStatus& status) {
  json j = {{"stage", status.stage}, {"state", name(status.state)},
            {"why", status.why},     {"wall_s", status.wall_s},
            {"cpu_s", status.cpu_s}, {"metrics", status.output.metrics}};
  j["skips"] = json::array();
  for (const Skip& skip : status.output.skips) j["skips"].push_back(pipeline::to_json(skip));
  j["warnings"] = status.output.warnings;
  if (status.error) j["error"] = pipeline::to_json(*status.error);
  return j;
}

void announce(terminal::Console& console, const StageStatus& s, bool dry_run) {
  const std::string brief = s.output.metrics.value("brief", std::string());
  switch (s.state) {
    case StageState::planned:
      if (dry_run)
        console.info(fmt::format("{:<14} would run: {}", s.stage, s.why));
      else
        console.detail(fmt::format("{:<14} starts: {}", s.stage, s.why));
      break;
    case StageState::ran:
      console.info(fmt::format("{:<14} {:>6.1f} s  {}", s.stage, s.wall_s, brief));
      for (const Skip& skip : s.output.skips)
        console.detail(
            fmt::format("{:<14}   skipped {}: {}; {}", "", skip.what, skip.why, skip.effect));
      for (const std::string& warning : s.output.warnings)
        console.warning(s.stage + ": " + warning);
      break;
    case StageState::unchanged:
      console.info(fmt::format("{:<14} unchanged  {}", s.stage, brief));
      break;
    case StageState::absent:
    case StageState::blocked:
      console.info(fmt::format("{:<14} not run: {}", s.stage, s.why));
      break;
    case StageState::failed:
      console.info(fmt::format("{:<14} failed: {}", s.stage, s.error->message()));
      break;
  }
}

}  // namespace

void add_folders(CLI::App& app, StageFolders& folders) {
  app.add_option("session", folders.session,
                 "Session folder, or the --out folder of an earlier run");
  app.add_option("--out", folders.out, "Folder of the results, one folder a stage")
      ->capture_default_str();
}

namespace {

/// run.json of an earlier run's folder; null when there is none.
Result<json> earlier_run(const std::string& folder) {
  const fs::path record = fs::path(folder) / run_file;
  std::error_code unreadable;  // whoever opens the session says why
  if (folder.empty() || !fs::exists(record, unreadable)) return json();
  ORBITFUSE_ASSIGN(const std::string text, read_file(record));
  json run = parse_json(text);
  if (run.is_discarded())
    return fail(ErrorKind::input, record.string(), "not JSON, or cut off",
                "give the session folder and --out");
  if (!run.is_object() || !run.contains("session") || !run["session"].is_string())
    return fail(ErrorKind::input, record.string(), "no session named in it",
                "give the session folder and --out");
  return run;
}

}  // namespace

namespace {

/// The session's own folder, or one for its images.
bool lies_among_frames(const fs::path& out, const fs::path& session) {
  std::error_code unreadable;  // whoever opens the session says why
  if (!fs::exists(session / "manifest.jsonl", unreadable)) return false;
  const fs::path inside = fs::weakly_canonical(out, unreadable)
                              .lexically_relative(fs::weakly_canonical(session, unreadable));
  return inside == "." || (!inside.empty() && (*inside.begin() == name(Modality::visible) ||
                                               *inside.begin() == name(Modality::thermal)));
}

/// Whether a call that ended like this is gone on with. What made one fail must not make the next
/// one fail too, which doesn't name it.
bool keeps_options(ErrorKind kind) {
  return kind == ErrorKind::cancelled || kind == ErrorKind::quality;
}

}  // namespace

Result<std::optional<std::uint64_t>> read_earlier_options(const std::string& folder,
                                                          config::Settings& settings) {
  ORBITFUSE_ASSIGN(const json run, earlier_run(folder));
  if (run.is_null()) return std::nullopt;
  const std::string file = (fs::path(folder) / run_file).string();
  const auto broken = [&](const char* key, const char* wanted) {
    return fail(ErrorKind::input, file, fmt::format("{} = {}", key, run[key].dump()),
                fmt::format("it must be {}; or give the session folder and --out", wanted));
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
  if (!run.is_null()) {
    if (folders.out == StageFolders{}.out) folders.out = folders.session;
    folders.session = run["session"];
  }
  if (lies_among_frames(folders.out, folders.session))
    return fail(ErrorKind::usage, "--out " + folders.out, "holds the session itself",
                "choose another folder");
  return {};
}

namespace {

/// Says the plan before the first stage; a budget that can't be held is a warning.
Result<std::unique_ptr<planning::RunPlanner>> start_planner(Context& context,
                                                            const stages::SessionInput& input,
                                                            const pipeline::RunOptions& options,
                                                            double budget_s, double start_s) {
  planning::PlannerInput planned;
  planned.budget_s = budget_s;
  ORBITFUSE_ASSIGN(planned.facts, planning::look_at(input, context.config));
  planned.stages = pipeline::closure(stages::build_stages(input, context.config), options.targets);
  planned.slowness = planning::measured_slowness();
  for (const auto& [modality, content] : input.content) planned.session_content += content + " ";
  planned.spent_s = wall_seconds() - start_s;
  auto planner = std::make_unique<planning::RunPlanner>(std::move(planned), options.out,
                                                        context.config, context.common.force);
  context.console.info(fmt::format("plan for {:.0f} s: {}", budget_s, planner->described()));
  if (!planner->first().fits)
    context.console.warning(fmt::format(
        "--budget: {:.0f} s are too few for this session on this machine; with the least of "
        "everything it takes about {:.0f} s, and that is done",
        budget_s, planner->first().expected_s));
  else if (!planner->first().all_used)
    context.console.info(
        fmt::format("more than {:.0f} s would bring nothing that was ever measured",
                    planner->first().expected_s));
  return planner;
}

}  // namespace

Status run_stages(Context& context, const StageFolders& given,
                  const std::vector<std::string>& targets, Missing missing, RunBudget budget_s) {
  const double start_s = wall_seconds();
  StageFolders folders = given;
  ORBITFUSE_TRY(resolve(folders));
  ORBITFUSE_ASSIGN(stages::SessionInput input,
                   stages::open_session_input(folders.session, context.progress));
  for (const std::string& warning : input.session.warnings) context.console.warning(warning);
  const std::string session = fs::absolute(folders.session).lexically_normal().string();
  if (const auto earlier = earlier_run(folders.out);
      earlier && !earlier->is_null() && (*earlier)["session"] != session)
    context.console.warning(
        fmt::format("{} holds results of {}: what this run doesn't reach stays that session's; "
                    "give each session an --out of its own",
                    folders.out, (*earlier)["session"].get<std::string>()));
  if (missing == Missing::leave_out && pipeline::finished_stages(folders.out).empty())
    return fail(
        ErrorKind::input, folders.out, "no finished stage in it",
        "run the session first: orbitfuse run " + folders.session + " --out " + folders.out);
  const pipeline::RunOptions options{.out = folders.out,
                                     .targets = targets,
                                     .force = context.common.force,
                                     .resume = context.common.resume,
                                     .dry_run = context.common.dry_run,
                                     .targets_only = missing == Missing::leave_out};
  std::unique_ptr<planning::RunPlanner> planner;
  if (budget_s) {
    ORBITFUSE_ASSIGN(planner, start_planner(context, input, options, *budget_s, start_s));
  }
  if (!budget_s && targets.empty() && !options.dry_run) {
    std::error_code ignored;  // a plan of an earlier run tells nothing of this one
    fs::remove(fs::path(folders.out) / planning::plan_file, ignored);
  }
  pipeline::Runner runner(stages::build_stages(input, context.config), options, context.progress);
  if (planner)
    runner.before_stage = [&](pipeline::Stage& stage, const std::vector<StageStatus>& finished) {
      planner->decide(stage.name, finished);
      for (pipeline::Stage& now : stages::build_stages(input, context.config))
        if (now.name == stage.name) stage = now;
      // The report tells of the plan. A disk that can't be written to stops the stage itself.
      if (!options.dry_run) (void)planner->save(finished);
    };
  runner.on_status = [&](const StageStatus& status) {
    announce(context.console, status, options.dry_run);
    json event = status_json(status);
    event["event"] = "stage";
    context.console.event(event);
  };
  const pipeline::RunSummary summary = runner.run();
  if (planner) {
    context.result["budget_s"] = *budget_s;
    if (!options.dry_run) ORBITFUSE_TRY(planner->save(summary.stages));
  }

  json list = json::array();
  for (const StageStatus& status : summary.stages) list.push_back(status_json(status));
  context.result.update({{"session", folders.session}, {"out", folders.out}, {"stages", list}});
  if (!context.common.dry_run && !summary.stages.empty()) {
    json run = {{"schema", 1},
                {"session", session},
                {"orbitfuse", pipeline::software_version()},
                {"config", context.config.settings().to_json()},
                {"seed", context.config.seed},
                {"stages", list}};
    if (summary.error && !keeps_options(summary.error->kind)) {
      const json before = earlier_run(folders.out).value_or(json());
      const bool known =
          before.is_object() && before.contains("session") && before["session"] == session;
      for (const char* key : {"config", "seed"}) {
        if (known && before.contains(key))
          run[key] = before[key];
        else
          run.erase(key);
      }
    }
    Status written = write_file_atomic(fs::path(folders.out) / run_file, run.dump(2) + "\n");
    if (!written && !summary.error) return written;
  }
  if (summary.error) return tl::unexpected(*summary.error);
  const StageStatus* report = summary.find("report");
  if (report && report->done()) {
    const std::string page = (fs::path(folders.out) / "report" / "report.html").string();
    context.result["report"] = page;
    context.console.data(page);
  }
  return {};
}

}  // namespace orbitfuse::cli
