// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>

#include "app/farm/overview.hpp"
#include "app/report/html.hpp"

namespace orbitfuse::farm {
namespace {
using report::escape;

constexpr const char* style = R"(
:root{color-scheme:light dark;font:15px/1.45 system-ui,sans-serif}
body{margin:2rem auto;max-width:76rem;padding:0 1rem}
table{border-collapse:collapse;width:100%}
th,td{padding:.35rem .6rem;text-align:right;border-bottom:1px solid #8884;vertical-align:top}
th:first-child,td:first-child,td.text,th.text{text-align:left}
tr.failed td:first-child,tr.interrupted td:first-child{border-left:4px solid #c33}
td.cause{color:#c33;text-align:left;max-width:28rem;overflow-wrap:anywhere}
)";

std::string figure(const std::optional<double>& value, double scale, const char* unit) {
  return value ? fmt::format("{:.1f}{}", scale * *value, unit) : "–";
}

/// A folder's name as the path of a link.
std::string link_path(const std::string& name) {
  std::string path;
  for (const char c : name) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       c == '-' || c == '_' || c == '.';
    path += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return path;
}

std::string row(const SessionOverview& s, std::size_t stages) {
  const std::string name_cell = s.report ? fmt::format("<a href=\"{}/report/report.html\">{}</a>",
                                                       link_path(s.name), escape(s.name))
                                         : escape(s.name);
  const std::string state =
      s.stage.empty() ? "done" : fmt::format("{} at {}", name(s.state), s.stage);
  return fmt::format(
      "<tr class=\"{}\"><td>{}</td><td class=\"text\">{}</td><td>{}/{}</td><td>{}</td><td>{}</td>"
      "<td>{}</td><td>{}</td><td>{}</td><td>{:.1f}</td><td>{:.1f}</td><td>{:.0f}</td><td>{}</td>"
      "<td class=\"cause\">{}</td></tr>\n",
      name(s.state), name_cell, escape(state), s.done, stages, figure(s.posed_visible, 100, " %"),
      figure(s.posed_thermal, 100, " %"), figure(s.doubtful_thermal, 1, ""),
      figure(s.psnr_visible_db, 1, ""), figure(s.psnr_thermal_db, 1, ""), s.wall_s / 60,
      s.cpu_s / 60, s.memory_mb, s.starts, escape(s.cause));
}

}  // namespace

std::string to_html(const std::vector<SessionOverview>& sessions, const FarmPlan& plan) {
  const auto count = [&](JobState state) {
    return std::count_if(sessions.begin(), sessions.end(),
                         [&](const SessionOverview& s) { return s.state == state; });
  };
  double cpu_s = 0;
  std::string rows;
  for (const SessionOverview& s : sessions) {
    cpu_s += s.cpu_s;
    rows += row(s, plan.stages.size());
  }
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width\"><title>OrbitFuse farm</title>"
      "<style>{}</style></head><body>\n<h1>{} sessions</h1>\n<p>{} done, {} failed, {} "
      "interrupted, "
      "{} running, {} waiting; {:.2f} CPU h.</p>\n"
      "<table><thead><tr><th>Session</th><th class=\"text\">State</th><th>Stages</th>"
      "<th>Visible views posed</th><th>Thermal views posed</th><th>Thermal views in doubt</th>"
      "<th>Visible PSNR, dB</th><th>Thermal PSNR, dB</th><th>Wall, min</th><th>CPU, min</th>"
      "<th>Memory, MB</th><th>Starts</th><th class=\"text\">Cause</th></tr></thead><tbody>\n{}"
      "</tbody></table>\n</body></html>\n",
      style, sessions.size(), count(JobState::done), count(JobState::failed),
      count(JobState::interrupted), count(JobState::running), count(JobState::waiting),
      cpu_s / 3600, rows);
}

}  // namespace orbitfuse::farm
