// SPDX-License-Identifier: BSD-3-Clause
#include "app/farm/job_outcome.hpp"

#include <array>
#include <nlohmann/json.hpp>

#include "core/json_fields.hpp"
#include "core/nested_text.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::farm {
namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr std::array<std::string_view, 5> state_names = {"waiting", "running", "done", "failed",
                                                         "interrupted"};

fs::path outcome_file(const fs::path& out, const std::string& session, const std::string& stage) {
  return records_of(out, session) / (stage + ".json");
}

}  // namespace

std::string_view name(JobState state) { return state_names[static_cast<std::size_t>(state)]; }

fs::path records_of(const fs::path& out, const std::string& session) {
  return out / ".farm" / session;
}

JobOutcome read_outcome(const fs::path& out, const std::string& session, const std::string& stage) {
  const auto text = read_file(outcome_file(out, session, stage), max_settings_bytes);
  if (!text) return {};
  const json j = parse_json(*text);
  const JsonFields fields(j, "", {});
  JobOutcome outcome;
  std::string state;
  if (!fields.get_all("state", state, "cause", outcome.cause, "host", outcome.host, "starts",
                      outcome.starts, "cpu_s", outcome.cpu_s, "wall_s", outcome.wall_s, "memory_mb",
                      outcome.memory_mb) ||
      !fields.get_present("exit_code", outcome.exit_code))
    return {};
  for (std::size_t i = 0; i < state_names.size(); ++i)
    if (state == state_names[i]) outcome.state = static_cast<JobState>(i);
  return outcome;
}

Status write_outcome(const fs::path& out, const std::string& session, const std::string& stage,
                     const JobOutcome& o) {
  const json code = o.exit_code ? json(*o.exit_code) : json();
  const json j = {{"schema", 1},      {"state", name(o.state)}, {"cause", o.cause},
                  {"host", o.host},   {"exit_code", code},      {"starts", o.starts},
                  {"cpu_s", o.cpu_s}, {"wall_s", o.wall_s},     {"memory_mb", o.memory_mb}};
  return write_file_atomic(outcome_file(out, session, stage), j.dump() + "\n");
}

std::size_t next_stage(const fs::path& out, const FarmPlan& plan, const std::string& session) {
  std::size_t i = 0;
  while (i < plan.stages.size() &&
         read_outcome(out, session, plan.stages[i]).state == JobState::done)
    ++i;
  return i;
}

}  // namespace orbitfuse::farm
