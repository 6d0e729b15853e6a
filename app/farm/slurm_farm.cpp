// SPDX-License-Identifier: BSD-3-Clause
#include "app/farm/slurm_farm.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <set>
#include <sstream>
#include <thread>

#include "app/farm/needs.hpp"
#include "app/farm/slurm.hpp"
#include "app/farm/stage_job.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::farm {
namespace fs = std::filesystem;

namespace {

/// Slurm's default MaxArraySize admits task ids below 1001.
constexpr std::size_t array_size = 1000;

/// A stop this near to the limit is Slurm's word that time runs out: 60 s before are asked for
/// (array_words), sbatch(1) may send it 60 s earlier, and the stage began after the job.
constexpr double time_warning_s = 130;

/// Whether a round is worth it: what failed by itself fails again.
bool is_to_run(const fs::path& out, const FarmPlan& plan, const FarmSession& session,
               bool failed_too) {
  const std::size_t next = next_stage(out, plan, session.name);
  if (next == plan.stages.size()) return false;
  if (failed_too) return true;
  const JobOutcome outcome = read_outcome(out, session.name, plan.stages[next]);
  return outcome.state != JobState::failed && outcome.starts < plan.tries;
}

std::string script(const FarmPlan& plan, const fs::path& out, const std::string& words) {
  return fmt::format("#!/bin/sh\nexec {} farm {} {}\n", shell_word(plan.program), words,
                     shell_word(out.string()));
}

Result<std::string> submit_script(std::vector<std::string> words, const fs::path& file,
                                  const std::string& text, const Progress& progress) {
  ORBITFUSE_TRY(write_file_atomic(file, text));
  words.push_back(file.string());
  ORBITFUSE_ASSIGN(const std::string id, slurm_output(words, progress));
  return id.substr(0, id.find(';'));  // "id;cluster" where there are several
}

Status submit_round(const fs::path& out, const FarmPlan& plan,
                    const std::vector<std::size_t>& tasks, SlurmRound& round,
                    const Progress& progress) {
  const fs::path scripts = out / ".farm" / "slurm";
  std::string after, all;
  for (const StageChain& chain : stage_chains(plan)) {
    const std::string text =
        fmt::format("#!/bin/sh\nexec {} farm stages {} $(({} + SLURM_ARRAY_TASK_ID)) {}\n",
                    shell_word(plan.program), shell_word(out.string()), round.first,
                    fmt::join(chain.stages, " "));
    ORBITFUSE_ASSIGN(
        after, submit_script(array_words(plan, out, chain, index_list(tasks), after),
                             scripts / fmt::format("{}-{}.sh", chain.stages.front(), round.first),
                             text, progress));
    round.jobs.push_back(after);
    round.stages.push_back(chain.stages);
    all += (all.empty() ? "" : ":") + after;
  }
  std::vector<std::string> words = {"sbatch",
                                    "--parsable",
                                    "--requeue",
                                    "--job-name=orbitfuse-gather",
                                    "--mem=200M",
                                    "--time=10",
                                    "--chdir=" + out.string(),
                                    "--dependency=afterany:" + all,
                                    "--output=" + (scripts / "gather-%A.log").string()};
  if (!plan.slurm.partition.empty()) words.push_back("--partition=" + plan.slurm.partition);
  if (!plan.slurm.account.empty()) words.push_back("--account=" + plan.slurm.account);
  ORBITFUSE_ASSIGN(const std::string gather, submit_script(words, scripts / "gather.sh",
                                                           script(plan, out, "gather"), progress));
  round.jobs.push_back(gather);
  return {};
}

struct JobClock {
  std::chrono::steady_clock::time_point began;
  double limit_s;
  bool is_late() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count() >
           limit_s - time_warning_s;
  }
};

/// Error, and on record, where Slurm has started this job too often.
Status not_given_up(const fs::path& out, const FarmPlan& plan, const FarmSession& session,
                    const std::string& stage, const JobOutcome& before) {
  // Slurm's own count, of this job alone: a user's `resume` gives all tries anew.
  const char* restarts = std::getenv("SLURM_RESTART_COUNT");
  if (restarts == nullptr || std::atoi(restarts) < plan.tries || before.starts == 0) return {};
  JobOutcome given_up = before;
  given_up.state = JobState::failed;
  given_up.cause = fmt::format("interrupted {} times; last on {}", before.starts, before.host);
  ORBITFUSE_TRY(write_outcome(out, session.name, stage, given_up));
  return fail(ErrorKind::device, session.name + "/" + stage, given_up.cause,
              "look at the node; then: orbitfuse farm resume " + out.string());
}

Result<JobOutcome> run_stage(const fs::path& out, const FarmPlan& plan, const FarmSession& session,
                             const std::string& stage, const JobClock& clock,
                             const Progress& progress) {
  ORBITFUSE_ASSIGN(StageJob job, StageJob::start(plan, out, session, stage));
  std::optional<JobOutcome> outcome;
  bool late = false;
  while (!(outcome = job.poll())) {
    if (progress.cancelled()) {
      late = late || clock.is_late();
      job.stop();
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  if (late && outcome->state == JobState::interrupted)
    outcome->cause = std::string(out_of_time) + " (Slurm's limit)";
  ORBITFUSE_TRY(write_outcome(out, session.name, stage, *outcome));
  return *outcome;
}

/// Of any session: nothing of the farm's runs now.
bool was_cut_off(const fs::path& out, const FarmPlan& plan, const std::string& stage) {
  return std::any_of(plan.sessions.begin(), plan.sessions.end(), [&](const FarmSession& session) {
    const JobState state = read_outcome(out, session.name, stage).state;
    return state == JobState::running || state == JobState::interrupted;
  });
}

}  // namespace

Status submit(const fs::path& out, FarmPlan& plan, bool failed_too, const Progress& progress) {
  // A task reads the plan, and on an idle node the first ones start at once.
  std::error_code ignored;
  const bool is_new = !fs::exists(out / plan_file, ignored);
  ORBITFUSE_TRY(write_plan(out, plan));
  std::vector<SlurmRound> rounds;
  for (std::size_t first = 0; first < plan.sessions.size(); first += array_size) {
    std::vector<std::size_t> tasks;
    for (std::size_t i = first; i < std::min(first + array_size, plan.sessions.size()); ++i)
      if (is_to_run(out, plan, plan.sessions[i], failed_too)) tasks.push_back(i - first);
    if (tasks.empty()) continue;
    rounds.push_back({first, {}, {}});
    Status submitted = submit_round(out, plan, tasks, rounds.back(), progress);
    if (submitted) continue;
    for (const SlurmRound& round : rounds) {
      std::vector<std::string> words = {"scancel"};
      words.insert(words.end(), round.jobs.begin(), round.jobs.end());
      if (words.size() > 1) (void)slurm_output(words, Progress{});
    }
    if (is_new) fs::remove(out / plan_file, ignored);
    return submitted;
  }
  plan.rounds = std::move(rounds);
  return write_plan(out, plan);
}

Result<std::vector<std::string>> queued_jobs(const fs::path& out, const FarmPlan& plan,
                                             const Progress& progress) {
  const char* self = std::getenv("SLURM_JOB_ID");
  std::set<std::string> ours;
  for (const SlurmRound& round : plan.rounds) ours.insert(round.jobs.begin(), round.jobs.end());
  // All jobs: asked for one it has forgotten, squeue fails. Suspended ones are not listed by
  // default, and go on later.
  ORBITFUSE_ASSIGN(const std::string text,
                   slurm_output({"squeue", "--noheader", "--format=%F %Z",
                                 "--states=PENDING,CONFIGURING,RUNNING,SUSPENDED,STOPPED,REQUEUED,"
                                 "COMPLETING"},
                                progress));
  std::istringstream lines(text);
  std::set<std::string> found;
  std::string id, folder;
  while (lines >> id && std::getline(lines >> std::ws, folder))
    if ((ours.count(id) > 0 || folder == out.string()) && (self == nullptr || id != self))
      found.insert(id);
  return std::vector<std::string>(found.begin(), found.end());
}

Status cancel(const fs::path& out, const FarmPlan& plan, const Progress& progress) {
  ORBITFUSE_ASSIGN(std::vector<std::string> words, queued_jobs(out, plan, progress));
  if (words.empty()) return {};
  words.insert(words.begin(), "scancel");
  ORBITFUSE_TRY(slurm_output(words, progress));
  return {};
}

Status run_task(const fs::path& out, const FarmPlan& plan, const std::vector<std::string>& stages,
                std::size_t session, const Progress& progress) {
  const FarmSession& s = plan.sessions.at(session);
  double limit_s = 0;
  for (const std::string& stage : stages) limit_s += 60 * plan.needs_of(stage).time_min;
  JobClock clock{std::chrono::steady_clock::now(), limit_s};
  for (const std::string& stage : stages) {
    const JobOutcome before = read_outcome(out, s.name, stage);
    if (before.state == JobState::done) continue;
    if (progress.cancelled())
      return fail(ErrorKind::cancelled, s.name, "stopped before " + stage,
                  "orbitfuse farm resume " + out.string());
    ORBITFUSE_TRY(not_given_up(out, plan, s, stage, before));
    ORBITFUSE_ASSIGN(const JobOutcome outcome, run_stage(out, plan, s, stage, clock, progress));
    if (outcome.state != JobState::done)
      return fail(outcome.state == JobState::failed ? ErrorKind::input : ErrorKind::cancelled,
                  s.name + "/" + stage, outcome.cause, "orbitfuse farm status " + out.string());
  }
  return {};
}

void raise_needs(const fs::path& out, FarmPlan& plan, const Progress& progress) {
  for (const SlurmRound& round : plan.rounds)
    for (std::size_t i = 0; i < round.stages.size() && i < round.jobs.size(); ++i) {
      auto states = slurm_output({"sacct", "--noheader", "--parsable2", "--allocations",
                                  "--format=State", "--jobs=" + round.jobs[i]},
                                 progress);
      if (!states)
        states = slurm_output({"scontrol", "--oneliner", "show", "job", round.jobs[i]}, progress);
      if (!states) continue;
      const bool memory = states->find("OUT_OF_MEMORY") != std::string::npos,
                 time = states->find("TIMEOUT") != std::string::npos;
      for (const std::string& stage : round.stages[i]) {
        if (!(memory || time) || !was_cut_off(out, plan, stage)) continue;
        if (memory) plan.needs[stage].memory_mb *= 2;
        if (time) plan.needs[stage].time_min *= 2;
      }
    }
  raise_interrupted(out, plan);
}

}  // namespace orbitfuse::farm
