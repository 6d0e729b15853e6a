// SPDX-License-Identifier: BSD-3-Clause
#include "app/farm/plan.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/json_fields.hpp"
#include "core/nested_text.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::farm {
namespace fs = std::filesystem;
using nlohmann::json;

namespace {

json to_json(const StageNeeds& needs) {
  json j = {{"cores", needs.cores},
            {"memory_mb", needs.memory_mb},
            {"time_min", needs.time_min},
            {"gpu", needs.gpu}};
  if (needs.usual_s) j["usual_s"] = *needs.usual_s;
  return j;
}

Status read_needs(const JsonFields& fields, FarmPlan& plan) {
  for (const std::string& stage : fields.keys()) {
    ORBITFUSE_ASSIGN(const JsonFields told, fields.child(stage.c_str()));
    StageNeeds& needs = plan.needs[stage];
    ORBITFUSE_TRY(told.get_all("cores", needs.cores, "memory_mb", needs.memory_mb, "time_min",
                               needs.time_min, "gpu", needs.gpu));
    ORBITFUSE_TRY(told.get_present("usual_s", needs.usual_s));
    if (needs.usual_s == 0.0) needs.usual_s.reset();  // earlier versions wrote 0 for not known
  }
  return {};
}

Status read_slurm(const JsonFields& fields, FarmPlan& plan) {
  SlurmOptions& slurm = plan.slurm;
  ORBITFUSE_TRY(fields.get_all("partition", slurm.partition, "gpu_partition", slurm.gpu_partition,
                               "account", slurm.account, "least_job_s", slurm.least_job_s));
  ORBITFUSE_ASSIGN(const std::vector<JsonFields> rounds, fields.children("rounds"));
  for (const JsonFields& told : rounds) {
    SlurmRound& round = plan.rounds.emplace_back();
    ORBITFUSE_TRY(told.get_all("first", round.first, "jobs", round.jobs, "stages", round.stages));
  }
  plan.on_slurm = true;
  return {};
}

Result<FarmPlan> plan_of(const JsonFields& fields) {
  FarmPlan plan;
  ORBITFUSE_TRY(fields.get_all("program", plan.program, "options", plan.options, "stages",
                               plan.stages, "tries", plan.tries));
  ORBITFUSE_ASSIGN(const std::vector<JsonFields> sessions, fields.children("sessions"));
  for (const JsonFields& told : sessions) {
    FarmSession& session = plan.sessions.emplace_back();
    ORBITFUSE_TRY(told.get_all("name", session.name, "folder", session.folder));
  }
  ORBITFUSE_ASSIGN(const JsonFields needs, fields.child("needs"));
  ORBITFUSE_TRY(read_needs(needs, plan));
  if (fields.has("slurm")) {
    ORBITFUSE_ASSIGN(const JsonFields slurm, fields.child("slurm"));
    ORBITFUSE_TRY(read_slurm(slurm, plan));
  }
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
  constexpr const char* remedy =
      "start a new farm in another folder; the sessions' results here stay usable";
  const JsonFields fields(j, file.string() + ": ", {ErrorKind::input, remedy});
  ORBITFUSE_TRY(fields.check_object());
  int schema = 0;
  ORBITFUSE_TRY(fields.get("schema", schema));
  if (schema != plan_schema) return fields.wrong("schema", fmt::format("{}", plan_schema));
  ORBITFUSE_ASSIGN(FarmPlan plan, plan_of(fields));
  if (plan.sessions.empty() || plan.stages.empty())
    return fail(ErrorKind::input, file.string(), "no sessions or no stages", remedy);
  return plan;
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
