// SPDX-License-Identifier: BSD-3-Clause
#include "app/farm/needs.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <thread>

namespace orbitfuse::farm {
namespace {

// Margins over the largest that was seen: sessions differ in frames and pixels, and a stage that is
// killed costs more than memory that lies idle.
constexpr double memory_margin = 1.5, time_margin = 4;
constexpr double least_memory_mb = 256, least_time_min = 5;

/// Wall seconds on 2 cores, the mean of two sessions (docs/benchmarks/run.md, 2026-11-23).
const std::map<std::string, double> measured_s = {
    {"poses_visible", 13}, {"depth", 19},  {"train_visible", 21}, {"poses_thermal", 29},
    {"train_thermal", 13}, {"render", 17}, {"fuse", 1},           {"metrics", 8}};

/// Whatever renders a field holds it on the device while it runs.
bool renders_fields(const std::string& stage) {
  return stage.starts_with("train_") || stage == "poses_thermal" || stage == "render" ||
         stage == "metrics";
}

}  // namespace

std::map<std::string, StageNeeds> default_needs(const std::vector<std::string>& stages, int cores,
                                                bool on_gpu) {
  std::map<std::string, StageNeeds> needs;
  for (const std::string& stage : stages) {
    StageNeeds& n = needs[stage];
    n.cores = cores;
    n.gpu = on_gpu && renders_fields(stage);
    if (stage == "register" || stage == "report")
      n = {.cores = 1, .memory_mb = 1000, .time_min = 15, .gpu = false, .usual_s = 1};
    if (const auto known = measured_s.find(stage); known != measured_s.end())
      n.usual_s = known->second;
  }
  return needs;
}

void learn_needs(const std::filesystem::path& out, const FarmPlan& finished,
                 std::map<std::string, StageNeeds>& needs) {
  for (auto& [stage, n] : needs) {
    double memory_mb = 0, wall_s = 0;
    for (const FarmSession& session : finished.sessions) {
      const JobOutcome outcome = read_outcome(out, session.name, stage);
      if (outcome.state != JobState::done) continue;
      memory_mb = std::max(memory_mb, outcome.memory_mb);
      wall_s = std::max(wall_s, outcome.wall_s);
    }
    if (wall_s <= 0) continue;
    n.memory_mb = std::max(least_memory_mb, std::ceil(memory_margin * memory_mb));
    n.time_min = std::max(least_time_min, std::ceil(time_margin * wall_s / 60));
    n.usual_s = wall_s;
  }
}

void raise_learned(const std::filesystem::path& out, FarmPlan& plan) {
  auto learned = plan.needs;
  learn_needs(out, plan, learned);
  for (auto& [stage, n] : plan.needs) {
    const StageNeeds& seen = learned.at(stage);
    n.memory_mb = std::max(n.memory_mb, seen.memory_mb);
    n.time_min = std::max(n.time_min, seen.time_min);
    n.usual_s = seen.usual_s;
  }
}

void raise_interrupted(const std::filesystem::path& out, FarmPlan& plan) {
  for (const std::string& stage : plan.stages) {
    StageNeeds needs = plan.needs_of(stage);
    for (const FarmSession& session : plan.sessions) {
      const JobOutcome outcome = read_outcome(out, session.name, stage);
      if (outcome.state != JobState::interrupted) continue;
      // The kernel kills the largest process of a job that is out of memory: the stage, not us.
      if (outcome.exit_code == exit_killed)
        needs.memory_mb = std::max(needs.memory_mb, std::ceil(2 * outcome.memory_mb));
      if (outcome.cause.starts_with(out_of_time))
        needs.time_min = std::max(needs.time_min, std::ceil(2 * outcome.wall_s / 60));
    }
    plan.needs[stage] = needs;
  }
}

Machine this_machine() {
  Machine machine;
  machine.cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  std::ifstream info("/proc/meminfo");
  std::string key, unit;
  double kilobytes = 0;
  while (info >> key >> kilobytes && std::getline(info, unit))
    if (key == "MemAvailable:") machine.memory_mb = kilobytes / 1024;
  return machine;
}

}  // namespace orbitfuse::farm
