// SPDX-License-Identifier: BSD-3-Clause
// bench_fusion [FOLDER] : every method and knob on the reference pairs (default ../shared/data/fusion):
// mean Qabf, Qcb, Qcv and SSIM against the references, and milliseconds for a 640x480 pair.
// bench_fusion --methods : the four methods at their defaults only.
// bench_fusion --out DIR : also DIR/fusion.json (all rows) and DIR/fusion.svg (Qabf against CPU time).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "core/cpu.hpp"
#include "core/file_io.hpp"
#include "core/parallel.hpp"
#include "fusion/fuse/fuse.hpp"
#include "fusion/metrics/metrics.hpp"

namespace fs = std::filesystem;
using namespace orbitfuse;

namespace {

struct Pair {
  std::string name;
  cv::Mat visible, thermal;
};

std::vector<Pair> load_pairs(const fs::path& folder) {
  std::vector<Pair> pairs;
  for (const auto& entry : fs::directory_iterator(folder / "pairs")) {
    const std::string file = entry.path().filename().string();
    if (!file.ends_with("_ir.png")) continue;
    const std::string name = file.substr(0, file.size() - 7);
    pairs.push_back({name, cv::imread((folder / "pairs" / (name + "_vis.png")).string(), cv::IMREAD_GRAYSCALE),
                     cv::imread(entry.path().string(), cv::IMREAD_GRAYSCALE)});
  }
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) { return a.name < b.name; });
  return pairs;
}

constexpr const char* shown[] = {"Qabf", "Qcb", "Qcv", "SSIM"};
using Means = std::map<std::string, double>;

std::map<std::string, Means> reference_means(const fs::path& folder) {
  std::ifstream file(folder / "reference" / "metrics.csv");
  std::map<std::string, Means> sums;
  std::map<std::string, int> counts;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream fields(line);
    std::string pair, method, metric, value;
    std::getline(fields, pair, ',');
    std::getline(fields, method, ',');
    std::getline(fields, metric, ',');
    std::getline(fields, value, ',');
    if (metric == "SSIM") continue;  // VIFB's sum over the sources; ours is the mean
    if (metric == "SSIM_mean") metric = "SSIM";
    sums[method][metric] += std::stod(value);
    counts[method + metric]++;
  }
  for (auto& [method, metrics] : sums)
    for (auto& [metric, value] : metrics) value /= counts[method + metric];
  return sums;
}

Means our_means(const std::vector<Pair>& pairs, const FusionOptions& options) {
  Means means;
  for (const Pair& pair : pairs) {
    const auto fused = fuse(pair.visible, pair.thermal, {}, options);
    if (!fused) {
      fmt::print(stderr, "{}: {}\n", pair.name, fused.error().message());
      std::exit(3);
    }
    const auto values = fusion_metrics(pair.visible, pair.thermal, *fused).value();
    for (const MetricValue& v : values)
      means[v.name] += v.value / static_cast<double>(pairs.size());
  }
  return means;
}

double process_cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

/// Least of several runs. CPU time of all threads holds on a machine with other work, wall time
/// only on an idle one.
struct Times {
  double wall_ms = 1e9, cpu_ms = 1e9;
};

/// The first pair at 640x480.
Times times(const std::vector<Pair>& pairs, const FusionOptions& options) {
  cv::Mat v, t;
  cv::resize(pairs[0].visible, v, {640, 480}, 0, 0, cv::INTER_AREA);
  cv::resize(pairs[0].thermal, t, {640, 480}, 0, 0, cv::INTER_AREA);
  Times best;
  for (int i = 0; i < 9; ++i) {
    FusionReport report;
    const double start = process_cpu_ms();
    if (!fuse(v, t, {}, options, &report)) std::exit(3);
    best.cpu_ms = std::min(best.cpu_ms, process_cpu_ms() - start);
    best.wall_ms = std::min(best.wall_ms, 1000 * report.wall_s);
  }
  return best;
}

struct Row {
  std::string what;
  Means means;
  Times times;
  bool timed = false;
};

void print(const Row& row) {
  fmt::print("| {} |", row.what);
  for (const char* metric : shown) fmt::print(" {:.4f} |", row.means.at(metric));
  if (row.timed) fmt::print(" {:.1f} | {:.1f} |\n", row.times.wall_ms, row.times.cpu_ms);
  else fmt::print(" - | - |\n");
}

std::string json(const std::vector<Row>& rows) {
  std::string text = "[\n";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    text += fmt::format("  {{\"method\": \"{}\"", rows[i].what);
    for (const char* metric : shown) text += fmt::format(", \"{}\": {:.17g}", metric, rows[i].means.at(metric));
    if (rows[i].timed)
      text += fmt::format(", \"wall_ms\": {:.3f}, \"cpu_ms\": {:.3f}", rows[i].times.wall_ms, rows[i].times.cpu_ms);
    text += i + 1 < rows.size() ? "},\n" : "}\n";
  }
  return text + "]\n";
}

/// Qabf and Qcb upwards, CPU time to the right on a logarithmic axis; the knob's name on hover.
std::string svg(const std::vector<Row>& rows) {
  std::string text = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"720\" height=\"420\" font-family=\"sans-serif\" "
                     "font-size=\"12\">\n<rect width=\"720\" height=\"420\" fill=\"white\"/>\n"
                     "<text x=\"20\" y=\"20\">640x480 pair: Qabf (filled) and Qcb (ring) against CPU ms</text>\n";
  const auto x = [](double ms) { return 50 + 280 * std::log10(std::clamp(ms, 1.0, 200.0)); };
  const auto y = [](double q) { return 380 - 1600 * (std::clamp(q, 0.45, 0.68) - 0.45); };
  for (const double ms : {1, 2, 5, 10, 20, 50, 100, 200})
    text += fmt::format("<text x=\"{:.0f}\" y=\"400\">{}</text>\n", x(ms), ms);
  for (const double q : {0.45, 0.5, 0.55, 0.6, 0.65}) text += fmt::format("<text x=\"10\" y=\"{:.0f}\">{}</text>\n", y(q), q);
  const std::map<std::string, std::string> colors = {
      {"best", "#c0392b"}, {"ms-srif", "#2471a3"}, {"pca-msif", "#229954"}, {"cnn-lpif", "#b7950b"}};
  double label = 40;
  for (const auto& [method, color] : colors)
    text += fmt::format("<text x=\"620\" y=\"{:.0f}\" fill=\"{}\">{}</text>\n", label += 16, color, method);
  for (const Row& row : rows) {
    if (!row.timed) continue;
    const std::string color = colors.at(row.what.substr(0, row.what.find(',')));
    for (const auto& [metric, fill] : {std::pair<const char*, std::string>{"Qabf", color}, {"Qcb", "none"}})
      text += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" fill=\"{}\" stroke=\"{}\"><title>{}: {} {:.4f}, {:.1f} ms</title></circle>\n",
                          x(row.times.cpu_ms), y(row.means.at(metric)), fill, color, row.what, metric,
                          row.means.at(metric), row.times.cpu_ms);
  }
  return text + "</svg>\n";
}

/// Exit status.
int write_reports(const fs::path& folder, const std::vector<Row>& rows) {
  for (const auto& [file, text] : {std::pair{"fusion.json", json(rows)}, {"fusion.svg", svg(rows)}})
    if (const Status written = write_file_atomic(folder / file, text); !written) {
      fmt::print(stderr, "{}\n", written.error().message());
      return 4;
    }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  bool only_methods = false;
  fs::path folder = "../shared/data/fusion", out;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--methods") only_methods = true;
    else if (word == "--out" && i + 1 < argc) out = argv[++i];
    else folder = word;
  }
  if (!fs::exists(folder / "pairs")) {
    fmt::print(stderr, "{}: no pairs; give the folder of the reference pairs\n", folder.string());
    return 3;
  }
  const auto pairs = load_pairs(folder);
  fmt::print("{}, {} threads, {} pairs\n\n| method | Qabf | Qcb | Qcv | SSIM | wall ms | CPU ms |\n|---|---|---|---|---|---|---|\n",
             cpu_description(), thread_count(), pairs.size());
  std::vector<Row> rows;
  const auto add = [&](Row row) {
    print(row);
    rows.push_back(std::move(row));
  };
  for (const auto& [method, means] : reference_means(folder)) add({"reference " + method, means, {}});
  const auto show = [&](const std::string& what, const FusionOptions& options) {
    add({what, our_means(pairs, options), times(pairs, options), true});
  };
  for (const std::string& method : fusion_method_names()) {
    FusionOptions options;
    options.method = fusion_method(method).value();
    show(method, options);
  }
  if (only_methods) return out.empty() ? 0 : write_reports(out, rows);
  FusionOptions o;
  o.method = FusionMethod::ms_srif;
  for (const double share : {0.0, 0.01, 0.03, 0.1, 0.3}) {
    o.ms_srif.relative_residual = share;
    show(fmt::format("ms-srif, patch left {}", share), o);
  }
  o.ms_srif = {};
  for (const int stride : {1, 4, 8}) {
    o.ms_srif.stride_px = stride;
    show(fmt::format("ms-srif, stride {}", stride), o);
  }
  o.ms_srif = {};
  for (const int levels : {3, 5}) {
    o.ms_srif.levels = levels;
    show(fmt::format("ms-srif, {} levels", levels), o);
  }
  o.method = FusionMethod::pca_msif;
  for (const int iterations : {5, 10, 30}) {
    o.pca_msif.smoother.iterations = iterations;
    show(fmt::format("pca-msif, {} iterations", iterations), o);
  }
  o.method = FusionMethod::cnn_lpif;
  for (const double same : {0.0, 4.0, 16.0}) {
    o.cnn_lpif.same_within = same;
    show(fmt::format("cnn-lpif, same within {}", same), o);
  }
  o.method = FusionMethod::best;
  for (const double sharpness : {2.0, 8.0, 16.0}) {
    o.best.sharpness = sharpness;
    show(fmt::format("best, sharpness {}", sharpness), o);
  }
  o.best = {};
  for (const double kept : {0.0, 0.2, 0.5, 1.0}) {
    o.best.contrast_kept = kept;
    show(fmt::format("best, contrast kept {}", kept), o);
  }
  o.best = {};
  for (const double preference : {0.0, 1.0, 4.0}) {
    o.best.visible_preference = preference;
    show(fmt::format("best, visible preference {}", preference), o);
  }
  o.best = {};
  for (const double weight : {0.0, 0.01, 0.04}) {
    o.best.brightness_weight = weight;
    show(fmt::format("best, brightness weight {}", weight), o);
  }
  o.best = {};
  for (const int levels : {3, 5, 6}) {
    o.best.levels = levels;
    show(fmt::format("best, {} levels", levels), o);
  }
  o.best = {};
  for (const int radius : {1, 3, 8}) {
    o.best.energy_radius_px = radius;
    show(fmt::format("best, energy radius {}", radius), o);
  }
  return out.empty() ? 0 : write_reports(out, rows);
}
