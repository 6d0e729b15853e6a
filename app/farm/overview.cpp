// SPDX-License-Identifier: BSD-3-Clause
#include "app/farm/overview.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "app/pipeline/stage_record.hpp"
#include "core/formats/csv.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::farm {
namespace fs = std::filesystem;
using nlohmann::json;

namespace {

/// A number of what a stage said; none when it is not there.
std::optional<double> number(const json& metrics, const char* pointer) {
  const json::json_pointer where(pointer);
  if (!metrics.contains(where) || !metrics.at(where).is_number()) return std::nullopt;
  return metrics.at(where).get<double>();
}

void add_quality(const fs::path& folder, SessionOverview& row) {
  const auto metrics_of = [&](const char* stage) {
    const auto record = pipeline::read_stage_record(folder / stage);
    return record ? record->output.metrics : json::object();
  };
  row.posed_visible = number(metrics_of("poses_visible"), "/gates/posed_ratio");
  const json thermal = metrics_of("poses_thermal");
  row.posed_thermal = number(thermal, "/gates/posed_ratio");
  row.doubtful_thermal = number(thermal, "/gates/views_doubtful");
  row.psnr_visible_db = number(metrics_of("train_visible"), "/heldout_psnr_db");
  row.psnr_thermal_db = number(metrics_of("train_thermal"), "/heldout_psnr_db");
  row.qabf_best = number(metrics_of("metrics"), "/fused/best/Qabf");
  std::error_code unreadable;
  row.report = fs::exists(folder / "report" / "report.html", unreadable);
}

std::string cell(const std::optional<double>& value) {
  return value ? fmt::format("{:.4g}", *value) : "";
}

}  // namespace

std::vector<SessionOverview> look_at_sessions(const fs::path& out, const FarmPlan& plan) {
  std::vector<SessionOverview> rows;
  for (const FarmSession& session : plan.sessions) {
    SessionOverview row;
    row.name = session.name;
    row.state = JobState::done;
    for (const std::string& stage : plan.stages) {
      const JobOutcome outcome = read_outcome(out, session.name, stage);
      row.starts += outcome.starts;
      row.cpu_s += outcome.cpu_s;
      row.wall_s += outcome.wall_s;
      row.memory_mb = std::max(row.memory_mb, outcome.memory_mb);
      if (outcome.state == JobState::done) {
        ++row.done;
      } else if (row.stage.empty()) {
        row.stage = stage;
        row.state = outcome.state;
        row.cause = outcome.cause;
      }
    }
    add_quality(out / session.name, row);
    rows.push_back(std::move(row));
  }
  return rows;
}

std::string to_csv(const std::vector<SessionOverview>& sessions) {
  std::string csv =
      "session,state,stage,cause,stages_done,starts,wall_s,cpu_s,memory_mb,posed_visible,"
      "posed_thermal,doubtful_thermal,psnr_visible_db,psnr_thermal_db,qabf_best\r\n";
  for (const SessionOverview& s : sessions)
    csv += fmt::format("{},{},{},{},{},{},{:.1f},{:.1f},{:.0f},{},{},{},{},{},{}\r\n",
                       csv_text(s.name), name(s.state), s.stage, csv_text(s.cause), s.done,
                       s.starts, s.wall_s, s.cpu_s, s.memory_mb, cell(s.posed_visible),
                       cell(s.posed_thermal), cell(s.doubtful_thermal), cell(s.psnr_visible_db),
                       cell(s.psnr_thermal_db), cell(s.qabf_best));
  return csv;
}

Status write_overview(const fs::path& out, const FarmPlan& plan,
                      const std::vector<SessionOverview>& sessions) {
  ORBITFUSE_TRY(write_file_atomic(out / "farm.csv", to_csv(sessions)));
  return write_file_atomic(out / "farm.html", to_html(sessions, plan));
}

}  // namespace orbitfuse::farm
