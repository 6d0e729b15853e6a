// SPDX-License-Identifier: BSD-3-Clause
#include "app/cli/run_stages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "app/cli/run_folder.hpp"
#include "app/pipeline/result_folder.hpp"
#include "app/pipeline/runner.hpp"
#include "app/planning/machine_speed.hpp"
#include "app/planning/run_planner.hpp"
#include "app/stages/build_stages.hpp"
#include "core/first_names.hpp"
#include "core/modality.hpp"
#include "core/system/clock.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::cli {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using pipeline::StageState;
using pipeline::StageStatus;

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
      else if (console.draws_bars())
        console.detail(fmt::format("{:<14} starts: {}", s.stage, s.why));
      else  // a log that stays empty for minutes looks like a program that hangs
        console.info(fmt::format("{:<14} starts: {}", s.stage, s.why));
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
      for (const std::string& warning : s.output.warnings)
        console.warning(s.stage + ": " + warning);
      break;
    case StageState::failed:
      // What to do comes last, where the program ends with it.
      if (s.error->kind != ErrorKind::cancelled)
        console.info(fmt::format("{:<14} failed: {}", s.stage, s.error->found));
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

/// What run.json says of a plan: the budget, and the user's values of the keys that it sets.
struct PlannedBefore {
  double budget_s = 0;
  json users;
  std::vector<std::string> given;
};

PlannedBefore planned_before(const std::string& folder) {
  const auto run = earlier_run(folder);
  if (!run || !run->is_object()) return {};
  try {
    const json& planned = run->at("planned");
    return {planned.at("budget_s").get<double>(), planned.at("users").get<json::object_t>(),
            planned.at("given").get<std::vector<std::string>>()};
  } catch (const json::exception&) {
    return {};  // it had none
  }
}

/// run.json holds what a run was made with, the planner's choices among it: for another plan they
/// become again what they were.
Status take_back_plan(Context& context, const std::string& folder, const PlannedBefore& before) {
  config::Settings settings = context.config.settings();
  for (const char* key : planning::planned_keys)
    if (before.users.contains(key) && context.given.count(key) == 0) {
      const std::string value = before.users.at(key).dump();
      ORBITFUSE_TRY(settings.apply(fmt::format("{}={}", key, value)).map_error([&](Error error) {
        error.kind = ErrorKind::input;  // the user didn't write it
        error.where = (fs::path(folder) / run_file).string();
        return error;
      }));
    }
  context.given.insert(before.given.begin(), before.given.end());
  return context.config.validate();
}

/// Whether a call that ended like this is gone on with. What made one fail must not make the next
/// one fail too, which doesn't name it.
bool keeps_options(ErrorKind kind) {
  return kind == ErrorKind::cancelled || kind == ErrorKind::quality;
}

/// One call of run_stages() or run_planned().
class StagedRun {
 public:
  StagedRun(Context& context, StageFolders folders, Missing missing)
      : context_(context), folders_(std::move(folders)), missing_(missing) {}

  Status open(const std::vector<std::string>& targets);
  /// Says the plan before the first stage; a budget that can't be held is a warning.
  Status plan(double budget_s);
  /// `whole`: of the verb that runs everything, so that an earlier plan no longer counts.
  Status run(bool whole);

 private:
  Status look_for_other_results();
  void take_cameras_of_run();
  void before_stage(pipeline::Stage& stage, const std::vector<StageStatus>& finished);
  Status record(const pipeline::RunSummary& summary, const json& list);
  void warn_of_overrun() const;
  double elapsed_s() const { return wall_seconds() - start_s_; }

  Context& context_;
  StageFolders folders_;
  const Missing missing_;
  const double start_s_ = wall_seconds();
  stages::SessionInput input_;
  /// Stages are made again when a plan changes.
  std::shared_ptr<nerf::KeptRenders> kept_ = std::make_shared<nerf::KeptRenders>();
  std::string session_;
  pipeline::RunOptions options_;
  std::unique_ptr<planning::RunPlanner> planner_;
  bool replaces_ = false;  ///< another session's results
  double budget_s_ = 0;
  json planned_;  ///< for run.json; null: there is no plan
};

/// Files of a run's names where no run has been are the user's own: nothing is written over them.
Status check_records(const fs::path& out) {
  std::error_code unreadable;
  for (const char* left : {".partial", ".lock"})
    if (fs::exists(out / left, unreadable)) return {};
  const auto run = earlier_run(out.string());
  if ((run && !run->is_null()) || !pipeline::finished_stages(out, stages::stage_names()).empty())
    return {};
  for (const char* file : {run_file, planning::plan_file})
    if (fs::exists(fs::symlink_status(out / file, unreadable)))
      return fail(ErrorKind::usage, (out / file).string(),
                  "is there already, and no run left it (it names no session, and there are no "
                  "results beside it)",
                  "choose another --out, or move it away");
  return {};
}

Status StagedRun::open(const std::vector<std::string>& targets) {
  ORBITFUSE_TRY(resolve(folders_));
  ORBITFUSE_TRY(check_records(folders_.out));
  ORBITFUSE_ASSIGN(input_, stages::open_session_input(folders_.session, context_.progress));
  for (const std::string& warning : input_.session.warnings) context_.console.warning(warning);
  session_ = fs::absolute(folders_.session).lexically_normal().string();
  ORBITFUSE_TRY(look_for_other_results());
  take_cameras_of_run();
  if (missing_ == Missing::leave_out &&
      pipeline::finished_stages(folders_.out, stages::stage_names()).empty())
    return fail(
        ErrorKind::input, folders_.out, "no finished stage in it",
        "run the session first: orbitfuse run " + folders_.session + " --out " + folders_.out);
  options_ = {.out = folders_.out,
              .targets = targets,
              .force = context_.common.force,
              .resume = context_.common.resume,
              .dry_run = context_.common.dry_run,
              .replace_all = replaces_,
              .replaced_files = {run_file, planning::plan_file},
              .targets_only = missing_ == Missing::leave_out};
  return {};
}

/// What --force removes of another session's results, and what else lies among them.
struct Replaced {
  std::vector<std::string> removed;
  std::string kept;
};

Replaced replaced_in(const fs::path& out) {
  const auto finished = pipeline::finished_stages(out, stages::stage_names());
  std::set<std::string> own = {".partial", ".lock", run_file, planning::plan_file};
  Replaced result;
  for (const std::string& stage : stages::stage_names()) {
    own.insert({stage, pipeline::failed_folder({}, stage).string()});
    if (finished.contains(stage)) result.removed.push_back(stage);
  }
  std::vector<std::string> others;
  std::error_code unreadable;
  for (const auto& entry : fs::directory_iterator(out, unreadable))
    if (const std::string file = entry.path().filename().string(); !own.contains(file))
      others.push_back(file);
  std::sort(others.begin(), others.end());
  result.kept = first_names(others, 5);
  return result;
}

/// Stages that this call doesn't reach would stay the other session's, and later verbs take results
/// as they lie: nothing is mixed.
Status StagedRun::look_for_other_results() {
  const auto found = other_results(folders_.out, input_.session, [&](Modality modality) {
    const auto content = input_.content.find(modality);
    return content == input_.content.end() ? std::string() : content->second;
  });
  if (!found) return {};
  if (missing_ == Missing::leave_out)
    return fail(ErrorKind::usage, "--out " + folders_.out, *found,
                "leave the session out: the folder of its results is enough");
  if (!context_.common.force)
    return fail(ErrorKind::usage, "--out " + folders_.out, *found,
                "give this session an --out of its own, or replace those results with --force");
  replaces_ = true;
  const Replaced there = replaced_in(folders_.out);
  context_.console.warning(fmt::format(
      "--force: {} {}; its results there {} first: {}{}", folders_.out, *found,
      context_.common.dry_run ? "would be removed" : "are removed", fmt::join(there.removed, ", "),
      there.kept.empty() ? std::string()
                         : fmt::format("; what else lies there stays: {}", there.kept)));
  return {};
}

/// Views that were rendered from given cameras stay those until other ones are asked for: the next
/// verb must not render the usual ones over them.
void StagedRun::take_cameras_of_run() {
  std::string& cameras = context_.config.render.cameras;
  if (!cameras.empty() || context_.given.contains("render.path") || replaces_) return;
  const json before = earlier_run(folders_.out).value_or(json());
  if (!is_of(before, input_.session)) return;
  if (const auto file = before.find("cameras"); file != before.end() && file->is_string())
    cameras = file->get<std::string>();
}

/// What a step of another recipe takes was never measured: its time has to be given.
Status check_recipes(const stages::RunConfig& config) {
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    const nerf::TrainOptions& options = config.train(modality).options;
    if (options.preset != nerf::default_preset(modality) && options.budget_s == 0)
      return fail(ErrorKind::usage, "--budget",
                  fmt::format("the recipe of train.{} is {}, of which no plan knows the time",
                              name(modality), options.preset),
                  fmt::format("set train.{}.budget_s too", name(modality)));
  }
  return {};
}

Status StagedRun::plan(double budget_s) {
  ORBITFUSE_TRY(check_recipes(context_.config));
  budget_s_ = budget_s;
  planned_ = {{"budget_s", budget_s},
              {"users", planning::planned_values(context_.config)},
              {"given", context_.given}};
  planning::PlannerInput planned;
  planned.budget_s = budget_s;
  ORBITFUSE_ASSIGN(planned.facts, planning::look_at(input_, context_.config));
  planned.stages =
      pipeline::closure(stages::build_stages(input_, context_.config), options_.targets);
  planned.slowness = planning::measured_slowness();
  for (const auto& [modality, content] : input_.content) planned.session_content += content + " ";
  planned.elapsed_s = [this] { return elapsed_s(); };
  planned.given = context_.given;
  planned.afresh = context_.common.force;
  planner_ =
      std::make_unique<planning::RunPlanner>(std::move(planned), options_.out, context_.config);
  context_.result["budget_s"] = budget_s;
  context_.console.info(fmt::format("plan for {:.0f} s: {}", budget_s, planner_->described()));
  if (!planner_->first().fits)
    context_.console.warning(fmt::format(
        "--budget: {:.0f} s are too few for this session on this machine; what ends soonest "
        "takes about {:.0f} s, and that is done",
        budget_s, planner_->first_total_s()));
  if (const std::string remark = planner_->remark(); !remark.empty()) context_.console.info(remark);
  return {};
}

void StagedRun::before_stage(pipeline::Stage& stage, const std::vector<StageStatus>& finished) {
  const std::string warning = planner_->decide(stage.name, finished);
  if (!warning.empty()) context_.console.warning(warning);
  for (pipeline::Stage& now : stages::build_stages(input_, context_.config, kept_))
    if (now.name == stage.name) stage = now;
  // The report tells of the plan. A disk that can't be written to stops the stage itself.
  if (!options_.dry_run) (void)planner_->save(finished);
}

/// run.json.
Status StagedRun::record(const pipeline::RunSummary& summary, const json& list) {
  if (options_.dry_run || summary.stages.empty()) return {};
  json run = {{"schema", 1},
              {"session", session_},
              {"session_id", input_.session.id},
              {"orbitfuse", pipeline::software_version()},
              {"config", context_.config.settings().to_json()},
              {"seed", context_.config.seed},
              {"stages", list}};
  if (!planned_.is_null()) run["planned"] = planned_;
  if (const std::string& cameras = context_.config.render.cameras; !cameras.empty())
    run["cameras"] = fs::absolute(cameras).lexically_normal().string();
  if (summary.error && !keeps_options(summary.error->kind)) {
    const json before = earlier_run(folders_.out).value_or(json());
    const bool known = is_of(before, input_.session);
    for (const char* key : {"config", "seed", "planned", "cameras"}) {
      if (known && before.contains(key))
        run[key] = before[key];
      else
        run.erase(key);
    }
  }
  return write_file_atomic(fs::path(folders_.out) / run_file, run.dump(2) + "\n");
}

void StagedRun::warn_of_overrun() const {
  constexpr double late = 1.05;
  if (planner_ && planner_->expects_to_hold() && elapsed_s() > late * budget_s_)
    context_.console.warning(fmt::format("--budget: the run took {:.0f} s of the {:.0f} s it had",
                                         elapsed_s(), budget_s_));
}

Status StagedRun::run(bool whole) {
  pipeline::Runner runner(stages::build_stages(input_, context_.config, kept_), options_,
                          context_.progress);
  runner.before_stage = [&](pipeline::Stage& stage, const std::vector<StageStatus>& finished) {
    if (planner_) return before_stage(stage, finished);
    std::error_code ignored;  // a plan of an earlier run tells nothing of this one
    if (whole && finished.empty() && !options_.dry_run)
      fs::remove(fs::path(folders_.out) / planning::plan_file, ignored);
  };
  runner.on_status = [&](const StageStatus& status) {
    announce(context_.console, status, options_.dry_run);
    json event = status_json(status);
    event["event"] = "stage";
    context_.console.event(event);
  };
  if (!whole && !planner_ &&
      !replaces_) {  // the plan of the run whose results these are stays known
    PlannedBefore before = planned_before(folders_.out);
    const json values = planning::planned_values(context_.config);
    for (const auto& [key, value] : values.items())
      if (context_.given.count(key) > 0) {
        before.users[key] = value;
        before.given.push_back(key);
      }
    if (before.budget_s > 0)
      planned_ = {{"budget_s", before.budget_s}, {"users", before.users}, {"given", before.given}};
  }
  const pipeline::RunSummary summary = runner.run();
  warn_of_overrun();
  json list = json::array();
  for (const StageStatus& status : summary.stages) list.push_back(status_json(status));
  context_.result.update({{"session", folders_.session}, {"out", folders_.out}, {"stages", list}});
  // Locked out, nothing of this folder is ours to write.
  Status written = record(summary, list);
  if (written && planner_ && !options_.dry_run && !summary.stages.empty())
    written = planner_->save(summary.stages);
  const StageStatus* report = summary.find("report");
  if (report && report->done()) {
    // It tells of a failure as well.
    const std::string page = (fs::path(folders_.out) / "report" / "report.html").string();
    context_.result["report"] = page;
    context_.console.data(page);
  }
  if (summary.error) return tl::unexpected(*summary.error);
  ORBITFUSE_TRY(written);
  return {};
}

}  // namespace

Status run_stages(Context& context, const StageFolders& folders,
                  const std::vector<std::string>& targets, Missing missing) {
  StagedRun staged(context, folders, missing);
  ORBITFUSE_TRY(staged.open(targets));
  return staged.run(false);
}

Status run_planned(Context& context, const StageFolders& folders,
                   const std::vector<std::string>& targets, std::optional<double> budget_s) {
  if (const PlannedBefore before = planned_before(folders.session); before.budget_s > 0) {
    ORBITFUSE_TRY(take_back_plan(context, folders.session, before));
    if (!budget_s) budget_s = before.budget_s;
  }
  StagedRun staged(context, folders, Missing::run);
  ORBITFUSE_TRY(staged.open(targets));
  if (budget_s) ORBITFUSE_TRY(staged.plan(*budget_s));
  return staged.run(targets.empty());
}

}  // namespace orbitfuse::cli
