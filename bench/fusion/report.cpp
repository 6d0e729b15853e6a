// SPDX-License-Identifier: BSD-3-Clause
#include "bench/fusion/report.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <string_view>

#include "core/system/file_io.hpp"

namespace orbitfuse::bench {
namespace {

std::string json(const std::vector<Row>& rows) {
  std::string text = "[\n";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    text += fmt::format("  {{\"method\": \"{}\"", rows[i].what);
    for (const char* metric : shown)
      if (rows[i].means.contains(metric))
        text += fmt::format(", \"{}\": {:.17g}", metric, rows[i].means.at(metric));
    if (rows[i].timed)
      text += fmt::format(", \"wall_ms\": {:.3f}, \"cpu_ms\": {:.3f}", rows[i].times.wall_ms,
                          rows[i].times.cpu_ms);
    text += i + 1 < rows.size() ? "},\n" : "}\n";
  }
  return text + "]\n";
}

/// Qabf and Qcb upwards, CPU time to the right on a logarithmic axis; the knob's name on hover.
std::string svg(const std::vector<Row>& rows) {
  std::string text =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"720\" height=\"420\" "
      "font-family=\"sans-serif\" "
      "font-size=\"12\">\n<rect width=\"720\" height=\"420\" fill=\"white\"/>\n"
      "<text x=\"20\" y=\"20\">640x480 pair: Qabf (filled) and Qcb (ring) against CPU ms</text>\n";
  const auto x = [](double ms) { return 50 + 280 * std::log10(std::clamp(ms, 1.0, 200.0)); };
  const auto y = [](double q) { return 380 - 1400 * (std::clamp(q, 0.45, 0.7) - 0.45); };
  for (const double ms : {1, 2, 5, 10, 20, 50, 100, 200})
    text += fmt::format("<text x=\"{:.0f}\" y=\"400\">{}</text>\n", x(ms), ms);
  for (const double q : {0.45, 0.5, 0.55, 0.6, 0.65})
    text += fmt::format("<text x=\"10\" y=\"{:.0f}\">{}</text>\n", y(q), q);
  const std::map<std::string, std::string> colors = {{"best", "#c0392b"},
                                                     {"ms-srif", "#2471a3"},
                                                     {"pca-msif", "#229954"},
                                                     {"cnn-lpif", "#b7950b"}};
  double label = 40;
  for (const auto& [method, color] : colors)
    text += fmt::format("<text x=\"620\" y=\"{:.0f}\" fill=\"{}\">{}</text>\n", label += 16, color,
                        method);
  for (const Row& row : rows) {
    if (!row.timed) continue;
    const std::string color = colors.at(row.what.substr(0, row.what.find(',')));
    for (const auto& [metric, fill] :
         {std::pair<const char*, std::string>{"Qabf", color}, {"Qcb", "none"}})
      text += fmt::format(
          "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" fill=\"{}\" stroke=\"{}\"><title>{}: {} "
          "{:.4f}, {:.1f} ms</title></circle>\n",
          x(row.times.cpu_ms), y(row.means.at(metric)), fill, color, row.what, metric,
          row.means.at(metric), row.times.cpu_ms);
  }
  return text + "</svg>\n";
}

}  // namespace

void print_header() {
  fmt::print(
      "| method | Qabf | Qcb | Qcv | SSIM | halo | wall ms | CPU ms "
      "|\n|---|---|---|---|---|---|---|---|\n");
}

void print(const Row& row) {
  fmt::print("| {} |", row.what);
  for (const char* metric : shown)
    if (row.means.contains(metric))
      fmt::print(" {:.{}f} |", row.means.at(metric), std::string_view(metric) == "Qcv" ? 1 : 4);
    else
      fmt::print(" - |");
  if (row.timed)
    fmt::print(" {:.1f} | {:.1f} |\n", row.times.wall_ms, row.times.cpu_ms);
  else
    fmt::print(" - | - |\n");
  std::fflush(stdout);
}

Status write_reports(const std::filesystem::path& folder, const std::vector<Row>& rows) {
  ORBITFUSE_TRY(write_file_atomic(folder / "fusion.json", json(rows)));
  return write_file_atomic(folder / "curves" / "fusion_knobs.svg", svg(rows));
}

}  // namespace orbitfuse::bench
