// SPDX-License-Identifier: BSD-3-Clause
#include "app/farm/local_farm.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <list>
#include <thread>

#include "app/farm/stage_job.hpp"

namespace orbitfuse::farm {
namespace fs = std::filesystem;

namespace {

/// How far a session is in this farm.
struct Road {
  std::size_t next = 0;
  bool busy = false, ended = false;
  double memory_factor = 1;  ///< raised after a stage was killed
};

struct Worker {
  std::size_t session;
  StageNeeds needs;
  StageJob job;
  bool late = false;
};

class LocalFarm {
 public:
  LocalFarm(const fs::path& out, const FarmPlan& plan, const LocalLimits& limits,
            const OnOutcome& on_outcome)
      : out_(out), plan_(plan), on_outcome_(on_outcome), roads_(plan.sessions.size()) {
    const Machine machine = this_machine();
    cores_ = limits.cores > 0 ? limits.cores : machine.cores;
    memory_mb_ = limits.memory_mb > 0 ? limits.memory_mb : 0.9 * machine.memory_mb;
    workers_ = limits.workers > 0 ? limits.workers : cores_;
    gpu_jobs_ = limits.gpu_jobs;
    for (std::size_t i = 0; i < roads_.size(); ++i) {
      roads_[i].next = next_stage(out, plan, plan.sessions[i].name);
      roads_[i].ended = roads_[i].next == plan.stages.size();
    }
  }

  Status run(const Progress& progress) {
    Status broken;
    while (true) {
      if (progress.cancelled() || !broken) {
        for (Worker& worker : running_) worker.job.stop();
        if (running_.empty()) break;
      } else {
        broken = start_all();
        if (broken && running_.empty()) return {};  // nothing left to start
      }
      if (Status gathered = gather(); !gathered && broken) broken = gathered;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    if (!broken) return broken;
    return fail(ErrorKind::cancelled, out_.string(), "stopped by the user",
                "orbitfuse farm resume " + out_.string());
  }

 private:
  StageNeeds needs_of(const Road& road) const {
    StageNeeds needs = plan_.needs_of(plan_.stages[road.next]);
    needs.memory_mb *= road.memory_factor;
    return needs;
  }

  /// A stage larger than the machine runs alone: it may do with less than was reckoned.
  bool fits(const StageNeeds& needs) const {
    if (running_.empty()) return true;
    int cores = needs.cores, gpu_jobs = needs.gpu ? 1 : 0;
    double memory_mb = needs.memory_mb;
    for (const Worker& worker : running_) {
      cores += worker.needs.cores;
      memory_mb += worker.needs.memory_mb;
      gpu_jobs += needs.gpu && worker.needs.gpu ? 1 : 0;
    }
    return static_cast<int>(running_.size()) < workers_ && cores <= cores_ &&
           memory_mb <= memory_mb_ && gpu_jobs <= gpu_jobs_;
  }

  Status start_all() {
    for (std::size_t i = 0; i < roads_.size(); ++i) {
      Road& road = roads_[i];
      if (road.busy || road.ended) continue;
      const StageNeeds needs = needs_of(road);
      if (!fits(needs)) continue;
      ORBITFUSE_ASSIGN(StageJob job,
                       StageJob::start(plan_, out_, plan_.sessions[i], plan_.stages[road.next]));
      running_.push_back({i, needs, std::move(job)});
      road.busy = true;
    }
    return {};
  }

  Status gather() {
    Status status;
    for (auto it = running_.begin(); it != running_.end();) {
      if (!it->late && it->job.wall_s() > 60 * it->needs.time_min) {
        it->late = true;
        it->job.stop();
      }
      const auto outcome = it->job.poll();
      if (!outcome) {
        ++it;
        continue;
      }
      const Status kept = settle(*it, *outcome);
      if (!kept) status = kept;
      it = running_.erase(it);
    }
    return status;
  }

  Status settle(const Worker& worker, JobOutcome outcome) {
    Road& road = roads_[worker.session];
    const FarmSession& session = plan_.sessions[worker.session];
    const std::string stage = plan_.stages[road.next];
    road.busy = false;
    if (worker.late) outcome.cause = fmt::format("{}; raise its time in farm.json", out_of_time);
    if (outcome.state == JobState::done) {
      ++road.next;
      road.memory_factor = 1;
      road.ended = road.next == plan_.stages.size();
    } else {
      road.memory_factor *= 2;
      road.ended =
          outcome.state == JobState::failed || worker.late || outcome.starts >= plan_.tries;
    }
    on_outcome_(session, stage, outcome);
    return write_outcome(out_, session.name, stage, outcome);
  }

  const fs::path& out_;
  const FarmPlan& plan_;
  const OnOutcome& on_outcome_;
  std::vector<Road> roads_;
  std::list<Worker> running_;
  int cores_ = 1, workers_ = 1, gpu_jobs_ = 1;
  double memory_mb_ = 0;
};

}  // namespace

Status LocalLimits::validate() const {
  for (const auto& [option, value] : {std::pair<const char*, double>("--workers", workers),
                                      {"--cores", cores},
                                      {"--memory", memory_mb}})
    if (!(value >= 0 && std::isfinite(value)))
      return fail(ErrorKind::usage, option, fmt::format("{}", value),
                  "choose 0 or more; 0 means what this machine has");
  if (gpu_jobs < 1)
    return fail(ErrorKind::usage, "--gpu-jobs", fmt::format("{}", gpu_jobs), "choose 1 or more");
  return {};
}

Status check_limits(const fs::path& out, const FarmPlan& plan, const LocalLimits& limits) {
  for (const FarmSession& session : plan.sessions)
    for (std::size_t i = next_stage(out, plan, session.name); i < plan.stages.size(); ++i) {
      const StageNeeds needs = plan.needs_of(plan.stages[i]);
      const std::string stage = "stage " + plan.stages[i];
      if (limits.memory_mb > 0 && needs.memory_mb > limits.memory_mb)
        return fail(
            ErrorKind::usage, stage,
            fmt::format("needs {:.0f} MB, --memory is {:g}", needs.memory_mb, limits.memory_mb),
            "give more, start with --like a farm that needed less, or lower the need in "
            "the farm's farm.json and resume it");
      if (limits.cores > 0 && needs.cores > limits.cores)
        return fail(ErrorKind::usage, stage,
                    fmt::format("needs {} cores, --cores is {}", needs.cores, limits.cores),
                    "give more, start with fewer --stage-cores, or lower the need in the farm's "
                    "farm.json and resume it");
    }
  return {};
}

Status run_local(const fs::path& out, const FarmPlan& plan, const LocalLimits& limits,
                 const OnOutcome& on_outcome, const Progress& progress) {
  ORBITFUSE_TRY(limits.validate());
  return LocalFarm(out, plan, limits, on_outcome).run(progress);
}

}  // namespace orbitfuse::farm
