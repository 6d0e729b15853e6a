// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "app/cli/option_pairs.hpp"
#include "app/cli/run_folder.hpp"
#include "app/cli/verb.hpp"
#include "app/config/settings.hpp"
#include "app/farm/farm_lock.hpp"
#include "app/farm/folder_probe.hpp"
#include "app/farm/local_farm.hpp"
#include "app/farm/overview.hpp"
#include "app/farm/slurm_farm.hpp"
#include "app/pipeline/out_folder.hpp"
#include "app/stages/build_stages.hpp"
#include "recon/nerf/compute_device.hpp"

namespace orbitfuse::cli {
namespace {
namespace fs = std::filesystem;
using namespace farm;
using nlohmann::json;

struct FarmOptions {
  std::vector<std::string> words;  ///< sessions, or status|resume|cancel and the farm's folder
  std::string out = "farm";
  std::string like;  ///< an earlier farm, whose stages were measured
  bool slurm = false;
  LocalLimits limits;
  SlurmOptions cluster;
  int stage_cores = 2, tries = 3;
  std::set<std::string> given;  ///< as they were typed: "--out"
};

/// Tells how the sessions stand and writes the page; quality error when some did not end well.
Status conclude(Context& context, const fs::path& out, const FarmPlan& plan, bool ended) {
  const std::vector<SessionOverview> rows = look_at_sessions(out, plan);
  const bool dry = context.common.dry_run;
  if (!dry) ORBITFUSE_TRY(write_overview(out, plan, rows));
  json sessions = json::array();
  std::size_t done = 0;
  std::string first_bad;
  for (const SessionOverview& row : rows) {
    sessions.push_back({{"session", row.name},
                        {"state", name(row.state)},
                        {"stage", row.stage},
                        {"cause", row.cause},
                        {"starts", row.starts},
                        {"cpu_s", row.cpu_s},
                        {"wall_s", row.wall_s}});
    context.console.data(fmt::format("{:<24} {:<12} {}/{}{}{}", row.name, name(row.state), row.done,
                                     plan.stages.size(), row.stage.empty() ? "" : "  " + row.stage,
                                     row.cause.empty() ? "" : ": " + row.cause));
    if (row.state == JobState::done)
      ++done;
    else if (first_bad.empty())
      first_bad = row.name;
  }
  context.result["sessions"] = sessions;
  if (!dry) context.result["page"] = (out / "farm.html").string();
  if (!ended || done == rows.size()) return {};
  return fail(ErrorKind::quality, out.string(),
              fmt::format("{} of {} sessions are not done, {} the first", rows.size() - done,
                          rows.size(), first_bad),
              "mend what is named above, then: orbitfuse farm resume " + out.string());
}

Status run_here(Context& context, const fs::path& out, const FarmPlan& plan,
                const FarmOptions& options) {
  const OnOutcome tell = [&](const FarmSession& session, const std::string& stage,
                             const JobOutcome& o) {
    context.console.info(fmt::format("{:<24} {:<14} {:<12} {:>7.1f} s {:>6.0f} MB  {}",
                                     session.name, stage, name(o.state), o.wall_s, o.memory_mb,
                                     o.cause));
  };
  const Status ran = run_local(out, plan, options.limits, tell, context.progress);
  const Status concluded = conclude(context, out, plan, true);
  return ran ? concluded : ran;
}

/// What every run is given besides its session.
std::vector<std::string> passed_on(const CommonOptions& common) {
  std::vector<std::string> words;
  if (!common.config_file.empty()) words = {"--config", fs::absolute(common.config_file).string()};
  for (const std::string& set : common.overrides) words.insert(words.end(), {"--set", set});
  words.insert(words.end(), {"--seed", std::to_string(common.seed), "--device", common.device});
  return words;
}

Status check_new(const fs::path& out) {
  std::error_code unreadable;
  if (!fs::exists(out / plan_file, unreadable)) return {};
  return fail(ErrorKind::usage, out.string(), "a farm was started in it before",
              "go on with it: orbitfuse farm resume " + out.string() + "; or another --out");
}

/// A word that was to be an order, as `stauts`.
Status check_slip(const std::vector<std::string>& words) {
  std::error_code unreadable;
  if (words.size() != 2 || fs::exists(words[0], unreadable)) return {};
  const std::string meant = config::nearest(words[0], {"status", "resume", "cancel"});
  if (meant.empty()) return {};
  return fail(ErrorKind::usage, "farm " + words[0], "no such order and no such folder",
              "did you mean '" + meant + "'?");
}

Result<FarmPlan> plan_to_learn_from(const std::string& like) {
  auto earlier = read_plan(like);
  if (earlier) return earlier;
  return fail(earlier.error().kind, "--like", "'" + like + "': " + earlier.error().found,
              "name the --out folder of an earlier farm, or leave it out");
}

Status start_farm(Context& context, const FarmOptions& options) {
  ORBITFUSE_TRY(options.limits.validate());
  ORBITFUSE_TRY(options.cluster.validate());
  const bool on_gpu = context.common.device == "cuda";
  for (const char* option : {"--gpu-partition", "--gpu-jobs"})
    if (options.given.contains(option) && !on_gpu)
      return fail(ErrorKind::usage, option,
                  "no stage uses a GPU with --device " + context.common.device, "leave it out");
  if (on_gpu && !nerf::built_with_cuda())
    return fail(ErrorKind::unavailable, "--device cuda",
                "this build computes on the processor only",
                "configure it with -DORBITFUSE_CUDA=ON, or use --device cpu");
  for (const std::string& session : options.words) ORBITFUSE_TRY(answers(session));
  ORBITFUSE_TRY(answers(options.out));
  for (const std::string& session : options.words)
    if (lies_among_frames(options.out, session))
      return fail(ErrorKind::usage, "--out " + options.out, "holds the session itself",
                  "choose another folder");
  FarmPlan plan;
  ORBITFUSE_ASSIGN(plan.sessions, name_sessions(options.words));
  const fs::path out = fs::absolute(options.out).lexically_normal();
  std::error_code ec;
  plan.program = fs::read_symlink("/proc/self/exe", ec).string();
  plan.options = passed_on(context.common);
  plan.stages = stages::stage_names();
  plan.tries = options.tries;
  plan.on_slurm = options.slurm;
  plan.slurm = options.cluster;
  plan.needs = default_needs(plan.stages, options.stage_cores, on_gpu);
  if (!options.like.empty()) {
    ORBITFUSE_ASSIGN(const FarmPlan earlier, plan_to_learn_from(options.like));
    learn_needs(options.like, earlier, plan.needs);
  }
  ORBITFUSE_TRY(check_new(out));
  ORBITFUSE_TRY(pipeline::check_out_folder(out));
  ORBITFUSE_TRY(check_limits(out, plan, options.limits));
  if (context.common.dry_run) {
    for (const FarmSession& session : plan.sessions)
      context.console.data(
          fmt::format("{} would run in {}", session.folder, (out / session.name).string()));
    return {};
  }
  fs::create_directories(out / ".farm", ec);
  if (ec)
    return fail(ErrorKind::device, out.string(), ec.message(),
                "choose a folder you can write to with --out");
  FarmLock lock;
  ORBITFUSE_TRY(lock.acquire(out));
  ORBITFUSE_TRY(check_new(out));  // another may have been faster
  if (!options.slurm) {
    ORBITFUSE_TRY(write_plan(out, plan));
    return run_here(context, out, plan, options);
  }
  ORBITFUSE_TRY(submit(out, plan, true, context.progress));
  return conclude(context, out, plan, false);
}

/// What of this machine may be filled says nothing to Slurm.
Status check_machine(const FarmOptions& o, bool on_slurm) {
  for (const char* option : {"--workers", "--cores", "--memory", "--gpu-jobs"})
    ORBITFUSE_TRY(check_apart({{option, o.given.contains(option), "--slurm", on_slurm}}));
  return {};
}

Status resume_farm(Context& context, const fs::path& out, const FarmOptions& options,
                   bool by_user) {
  FarmLock lock;
  ORBITFUSE_TRY(lock.acquire(out));
  ORBITFUSE_ASSIGN(FarmPlan plan, read_plan(out));
  if (!plan.on_slurm) {
    raise_learned(out, plan);
    raise_interrupted(out, plan);
    ORBITFUSE_TRY(check_limits(out, plan, options.limits));
    return run_here(context, out, plan, options);
  }
  ORBITFUSE_TRY(check_machine(options, true));
  ORBITFUSE_ASSIGN(const auto queued, queued_jobs(out, plan, context.progress));
  if (!queued.empty())
    return fail(ErrorKind::usage, out.string(),
                fmt::format("{} of its jobs still wait or run in Slurm", queued.size()),
                "wait for them, or: orbitfuse farm cancel " + out.string());
  raise_needs(out, plan, context.progress);
  ORBITFUSE_TRY(submit(out, plan, by_user, context.progress));
  return conclude(context, out, plan, plan.rounds.empty());
}

Status cancel_farm(Context& context, const fs::path& out) {
  // A gathering job may be submitting: what it has not named yet would escape.
  FarmLock lock;
  ORBITFUSE_TRY(lock.acquire(out));
  ORBITFUSE_ASSIGN(const FarmPlan plan, read_plan(out));
  if (!plan.on_slurm)
    return fail(ErrorKind::usage, out.string(), "it runs on this machine",
                "stop it with Ctrl-C where it runs, or kill the process that farm.lock names");
  ORBITFUSE_TRY(cancel(out, plan, context.progress));
  return conclude(context, out, plan, false);
}

Status run_array_task(Context& context, const fs::path& out,
                      const std::vector<std::string>& words) {
  ORBITFUSE_ASSIGN(const FarmPlan plan, read_plan(out));
  const bool numbered = words.size() > 3 && words[2].size() < 10 && !words[2].empty() &&
                        words[2].find_first_not_of("0123456789") == std::string::npos &&
                        std::stoul(words[2]) < plan.sessions.size();
  const bool known =
      numbered && std::all_of(words.begin() + 3, words.end(), [&](const auto& stage) {
        return std::find(plan.stages.begin(), plan.stages.end(), stage) != plan.stages.end();
      });
  if (!known)
    return fail(ErrorKind::usage, "farm stages", "no such stage or session in " + out.string(),
                "farm stages DIR NUMBER STAGE... is what the farm's own jobs call");
  return run_task(out, plan, {words.begin() + 3, words.end()}, std::stoul(words[2]),
                  context.progress);
}

Status check_start(const FarmOptions& o) {
  for (const char* option : {"--partition", "--gpu-partition", "--account"})
    ORBITFUSE_TRY(check_needs({{option, o.given.contains(option), "--slurm", o.slurm}}));
  return check_machine(o, o.slurm);
}

/// What a farm does was said when it was started; only what this machine spares may change.
Status check_order(const FarmOptions& o, const std::string& order) {
  std::set<std::string> unused{"--out",     "--like",   "--slurm",       "--tries",
                               "--account", "--config", "--stage-cores", "--partition",
                               "--set",     "--seed",   "--device",      "--gpu-partition"};
  if (order != "resume") unused.insert({"--workers", "--cores", "--memory", "--gpu-jobs"});
  const std::string words = "farm " + order;
  for (const std::string& option : o.given) {
    ORBITFUSE_TRY(check_apart({{option.c_str(), unused.contains(option), words.c_str(), true}}));
  }
  return {};
}

/// A farm that was killed, or lost its power, said nothing more of what it ran.
void tell_dead(Context& context, const fs::path& out, const FarmPlan& plan) {
  if (plan.on_slurm || !FarmLock::is_free(out)) return;
  const auto rows = look_at_sessions(out, plan);
  if (std::none_of(rows.begin(), rows.end(),
                   [](const SessionOverview& row) { return row.state == JobState::running; }))
    return;
  context.console.warning(fmt::format(
      "no farm works in {} any more: what is running in the table has stopped with it; go on with: "
      "orbitfuse farm resume {}",
      out.string(), out.string()));
}

Status run_farm(Context& context, const FarmOptions& options) {
  const std::vector<std::string>& words = options.words;
  const std::string first = words.empty() ? "" : words.front();
  const bool is_order = first == "status" || first == "resume" || first == "cancel" ||
                        first == "gather" || first == "stages";
  if (!is_order) {
    ORBITFUSE_TRY(check_start(options));
    ORBITFUSE_TRY(check_slip(words));
    return start_farm(context, options);
  }
  if (words.size() < 2 || (words.size() > 2 && first != "stages"))
    return fail(ErrorKind::usage, "farm " + first, fmt::format("{} folders", words.size() - 1),
                "name the farm's folder, one");
  const fs::path out = fs::absolute(words[1]).lexically_normal();
  ORBITFUSE_TRY(answers(out));
  const bool asked = first == "status" || first == "resume" || first == "cancel";
  if (asked) ORBITFUSE_TRY(check_order(options, first));
  if (asked && (first == "status" || context.common.dry_run)) {
    ORBITFUSE_ASSIGN(const FarmPlan plan, read_plan(out));
    if (first != "status") context.console.info("would " + first + " the farm; so it stands now:");
    tell_dead(context, out, plan);
    return conclude(context, out, plan, false);
  }
  if (first == "stages") return run_array_task(context, out, words);
  ORBITFUSE_TRY(read_plan(out));  // a lock makes the folder
  if (first == "cancel") return cancel_farm(context, out);
  return resume_farm(context, out, options, first == "resume");
}

}  // namespace

Action add_farm(CLI::App& app) {
  const auto o = std::make_shared<FarmOptions>();
  app.add_option("sessions", o->words, "Session folders; or status, resume or cancel and a farm");
  app.add_option("--out", o->out, "Folder of the results, one folder a session")
      ->capture_default_str();
  app.add_option("--workers", o->limits.workers, "Stages at a time here; 0 = as many as fit");
  app.add_option("--cores", o->limits.cores, "Cores to fill here; 0 = all");
  app.add_option("--memory", o->limits.memory_mb, "Memory to fill here, MB; 0 = what is free");
  app.add_option("--gpu-jobs", o->limits.gpu_jobs, "Stages at a time that use the GPU here")
      ->capture_default_str();
  app.add_option("--stage-cores", o->stage_cores, "Cores of a stage")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  app.add_option("--tries", o->tries, "Starts of a stage that is interrupted")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  app.add_option("--like", o->like, "Earlier farm: memory and time of stages as measured there");
  app.add_flag("--slurm", o->slurm, "Submit to Slurm and return");
  app.add_option("--partition", o->cluster.partition, "Slurm's partition");
  app.add_option("--gpu-partition", o->cluster.gpu_partition, "Of stages that use a GPU");
  app.add_option("--account", o->cluster.account, "Slurm's account");
  return [o, &app](Context& context) {
    for (const CLI::Option* option : app.get_options())
      if (option->count() > 0) o->given.insert(option->get_name());
    return run_farm(context, *o);
  };
}

}  // namespace orbitfuse::cli
