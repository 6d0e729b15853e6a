// SPDX-License-Identifier: BSD-3-Clause
// bench_fusion [FOLDER] : every method and knob on the reference pairs (default ../shared/data/fusion):
// mean Qabf, Qcb, Qcv and SSIM against the three references, and milliseconds for a 640x480 pair.
// bench_fusion --methods : the four methods at their defaults only.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "core/cpu.hpp"
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

/// Best of several runs on the first pair at 640x480.
double milliseconds(const std::vector<Pair>& pairs, const FusionOptions& options) {
  cv::Mat v, t;
  cv::resize(pairs[0].visible, v, {640, 480}, 0, 0, cv::INTER_AREA);
  cv::resize(pairs[0].thermal, t, {640, 480}, 0, 0, cv::INTER_AREA);
  double best = 1e9;
  for (int i = 0; i < 7; ++i) {
    FusionReport report;
    if (!fuse(v, t, {}, options, &report)) std::exit(3);
    best = std::min(best, 1000 * report.wall_s);
  }
  return best;
}

void print(const std::string& what, const Means& means, double ms) {
  fmt::print("| {} |", what);
  for (const char* metric : shown) fmt::print(" {:.4f} |", means.at(metric));
  if (ms > 0) fmt::print(" {:.1f} |\n", ms);
  else fmt::print(" - |\n");
}

}  // namespace

int main(int argc, char** argv) {
  const bool only_methods = argc > 1 && std::string(argv[1]) == "--methods";
  const fs::path folder = argc > 1 && !only_methods ? argv[1] : "../shared/data/fusion";
  if (!fs::exists(folder / "pairs")) {
    fmt::print(stderr, "{}: no pairs; give the folder of the reference pairs\n", folder.string());
    return 3;
  }
  const auto pairs = load_pairs(folder);
  fmt::print("{}, {} threads, {} pairs\n\n| method | Qabf | Qcb | Qcv | SSIM | ms |\n|---|---|---|---|---|---|\n",
             cpu_description(), thread_count(), pairs.size());
  for (const auto& [method, means] : reference_means(folder)) print("reference " + method, means, 0);
  const auto show = [&](const std::string& what, const FusionOptions& options) {
    print(what, our_means(pairs, options), milliseconds(pairs, options));
  };
  for (const std::string& method : fusion_method_names()) {
    FusionOptions options;
    options.method = fusion_method(method).value();
    show(method, options);
  }
  if (only_methods) return 0;
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
  for (const double sharpness : {1.0, 2.0, 8.0, 16.0}) {
    o.best.sharpness = sharpness;
    show(fmt::format("best, sharpness {}", sharpness), o);
  }
  o.best = {};
  for (const int side : {5, 13, 17}) {
    o.best.base_window = side;
    show(fmt::format("best, base window {}", side), o);
  }
  o.best = {};
  for (const int side : {5, 9, 25, 33}) {
    o.best.base_vote = side;
    show(fmt::format("best, base vote {}", side), o);
  }
  o.best = {};
  for (const int levels : {3, 5, 6}) {
    o.best.levels = levels;
    show(fmt::format("best, {} levels", levels), o);
  }
  o.best = {};
  for (const int radius : {1, 2, 3, 6}) {
    o.best.energy_radius_px = radius;
    show(fmt::format("best, energy radius {}", radius), o);
  }
  return 0;
}
