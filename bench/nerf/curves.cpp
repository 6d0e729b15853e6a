// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "bench/nerf/experiment.hpp"
#include "core/system/cpu.hpp"
#include "core/system/file_io.hpp"
#include "core/system/parallel.hpp"

namespace orbitfuse::bench {
namespace {

constexpr int width = 760, height = 440, left = 50, bottom = 400, right = 560, top = 40;

nlohmann::json json_of(const std::vector<Run>& runs) {
  nlohmann::json all = {
      {"cpu", cpu_description()}, {"threads", thread_count()}, {"isa", name(best_isa())}};
  for (const Run& run : runs) {
    nlohmann::json points = nlohmann::json::array();
    for (const nerf::CurvePoint& p : run.report.curve)
      points.push_back({{"cpu_s", p.cpu_s},
                        {"wall_s", p.wall_s},
                        {"step", p.step},
                        {"test_db", p.heldout_psnr},
                        {"train_db", p.train_psnr},
                        {"samples_per_ray", p.samples_per_ray}});
    all["runs"].push_back(
        {{"name", run.name}, {"before_cpu_s", run.before_cpu_s}, {"curve", points}});
  }
  return all;
}

/// Decibels upwards, CPU seconds (what came before training included) to the right.
std::string svg_of(const std::vector<Run>& runs) {
  double last_s = 1, low = 1e9, high = -1e9;
  for (const Run& run : runs)
    for (const nerf::CurvePoint& p : run.report.curve) {
      last_s = std::max(last_s, run.before_cpu_s + p.cpu_s);
      low = std::min(low, p.heldout_psnr);
      high = std::max(high, p.heldout_psnr);
    }
  low = std::floor(low), high = std::max(low + 1, std::ceil(high));
  const auto x = [&](double s) { return left + (right - left) * s / last_s; };
  const auto y = [&](double db) { return bottom - (bottom - top) * (db - low) / (high - low); };
  std::string text = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" "
      "font-family=\"sans-serif\" font-size=\"12\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n"
      "<text x=\"{2}\" y=\"20\">test views, dB, against CPU seconds (what comes before included); "
      "{3}</text>\n",
      width, height, left, cpu_description());
  for (double db = low; db <= high; db += std::max(1.0, std::ceil((high - low) / 10)))
    text += fmt::format(
        "<text x=\"10\" y=\"{0:.0f}\">{1:.0f}</text><line x1=\"{2}\" x2=\"{3}\" y1=\"{0:.0f}\" "
        "y2=\"{0:.0f}\" stroke=\"#ddd\"/>\n",
        y(db), db, left, right);
  for (int i = 0; i <= 6; ++i)
    text += fmt::format("<text x=\"{:.0f}\" y=\"{}\">{:.0f}</text>\n", x(last_s * i / 6),
                        bottom + 20, last_s * i / 6);
  const char* colors[] = {"#c0392b", "#2471a3", "#229954", "#b7950b", "#7d3c98", "#566573"};
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const char* color = colors[i % std::size(colors)];
    std::string points;
    for (const nerf::CurvePoint& p : runs[i].report.curve)
      points += fmt::format("{:.1f},{:.1f} ", x(runs[i].before_cpu_s + p.cpu_s), y(p.heldout_psnr));
    text += fmt::format(
        "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"/>\n"
        "<text x=\"{}\" y=\"{}\" fill=\"{}\">{}</text>\n",
        points, color, right + 10, top + 18 * (static_cast<int>(i) + 1), color, runs[i].name);
  }
  return text + "</svg>\n";
}

}  // namespace

Status write_curves(const std::string& folder, const std::string& stem,
                    const std::vector<Run>& runs) {
  const std::filesystem::path base = folder;
  ORBITFUSE_TRY(write_file_atomic(base / (stem + ".json"), json_of(runs).dump(1) + "\n"));
  return write_file_atomic(base / (stem + ".svg"), svg_of(runs));
}

}  // namespace orbitfuse::bench
