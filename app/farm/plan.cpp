// SPDX-License-Identifier: BSD-3-Clause
#include "app/farm/plan.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/nested_text.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::farm {
namespace fs = std::filesystem;
using nlohmann::json;

namespace {

json to_json(const StageNeeds& needs) {
  return {{"cores", needs.cores},
          {"memory_mb", needs.memory_mb},
          {"time_min", needs.time_min},
          {"gpu", needs.gpu},
          {"usual_s", needs.usual_s}};
}

FarmPlan from_json(const json& j) {
  FarmPlan plan;
  plan.program = j.at("program");
  plan.options = j.at("options").get<std::vector<std::string>>();
  plan.stages = j.at("stages").get<std::vector<std::string>>();
  plan.tries = j.at("tries");
  for (const json& s : j.at("sessions")) plan.sessions.push_back({s.at("name"), s.at("folder")});
  for (const auto& [stage, n] : j.at("needs").items())
    plan.needs[stage] = {n.at("cores"), n.at("memory_mb"), n.at("time_min"), n.at("gpu"),
                         n.value("usual_s", 0.0)};
  if (!j.contains("slurm")) return plan;
  const json& slurm = j["slurm"];
  plan.on_slurm = true;
  plan.slurm = {slurm.at("partition"), slurm.at("gpu_partition"), slurm.at("account"),
                slurm.at("least_job_s")};
  for (const json& r : slurm.at("rounds"))
    plan.rounds.push_back({r.at("first"), r.at("jobs").get<std::vector<std::string>>(),
                           r.at("stages").get<std::vector<std::vector<std::string>>>()});
  return plan;
}

}  // namespace

Status SlurmOptions::validate() const {
  for (const std::string& name : {partition, gpu_partition, account})
    if (!name.empty() && name.front() == '-')
      return fail(ErrorKind::usage, name, "no name of a partition or account",
                  "sinfo lists the partitions");
  return {};
}

StageNeeds FarmPlan::needs_of(const std::string& stage) const {
  const auto it = needs.find(stage);
  return it == needs.end() ? StageNeeds{} : it->second;
}

Result<std::vector<FarmSession>> name_sessions(const std::vector<std::string>& folders) {
  std::vector<FarmSession> sessions;
  std::map<std::string, std::string> seen;
  for (const std::string& given : folders) {
    std::error_code ec;
    const fs::path folder = fs::canonical(given, ec);
    if (ec || !fs::is_directory(folder, ec))
      return fail(ErrorKind::input, given, "no such folder", "name folders of sessions");
    const std::string name = folder.filename().string();
    if (name.empty() || name.front() == '.' || name.starts_with("farm."))
      return fail(ErrorKind::usage, given, fmt::format("its name '{}' is the farm's own", name),
                  "rename the session's folder");
    const auto [it, is_new] = seen.emplace(name, given);
    if (!is_new)
      return fail(
          ErrorKind::usage, given,
          fmt::format("called '{}' like {}: their results would share a folder", name, it->second),
          "rename one of the two folders, or give each a farm of its own");
    sessions.push_back({name, folder.string()});
  }
  if (sessions.empty())
    return fail(ErrorKind::usage, "sessions", "none given", "name one or more session folders");
  return sessions;
}

Result<FarmPlan> read_plan(const fs::path& out) {
  const fs::path file = out / plan_file;
  std::error_code ec;
  if (!fs::exists(file, ec))
    return fail(ErrorKind::input, out.string(), "no farm: it has no farm.json",
                "start one: orbitfuse farm SESSIONS... --out " + out.string());
  ORBITFUSE_ASSIGN(const std::string text, read_file(file, max_text_bytes));
  const json j = parse_json(text);
  const auto broken = [&](const std::string& found) {
    return fail(ErrorKind::input, file.string(), found,
                "start a new farm in another folder; the sessions' results here stay usable");
  };
  if (!j.is_object() || !j.contains("schema")) return broken("not JSON, or cut off");
  if (j["schema"] != plan_schema)
    return broken(fmt::format("schema {}, {} expected", j["schema"].dump(), plan_schema));
  try {
    FarmPlan plan = from_json(j);
    if (plan.sessions.empty() || plan.stages.empty()) return broken("no sessions or no stages");
    return plan;
  } catch (const json::exception& error) {
    return broken(error.what());
  }
}

Status write_plan(const fs::path& out, const FarmPlan& plan) {
  json j = {{"schema", plan_schema},  {"program", plan.program}, {"options", plan.options},
            {"stages", plan.stages},  {"tries", plan.tries},     {"sessions", json::array()},
            {"needs", json::object()}};
  for (const FarmSession& s : plan.sessions)
    j["sessions"].push_back({{"name", s.name}, {"folder", s.folder}});
  for (const auto& [stage, needs] : plan.needs) j["needs"][stage] = to_json(needs);
  if (plan.on_slurm) {
    j["slurm"] = {{"partition", plan.slurm.partition},
                  {"gpu_partition", plan.slurm.gpu_partition},
                  {"account", plan.slurm.account},
                  {"least_job_s", plan.slurm.least_job_s},
                  {"rounds", json::array()}};
    for (const SlurmRound& r : plan.rounds)
      j["slurm"]["rounds"].push_back({{"first", r.first}, {"jobs", r.jobs}, {"stages", r.stages}});
  }
  return write_file_atomic(out / plan_file, j.dump(2) + "\n");
}

}  // namespace orbitfuse::farm
