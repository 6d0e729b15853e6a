// SPDX-License-Identifier: BSD-3-Clause
// bench_cnn_lpif [FOLDER] : CNN-LPIF's knobs on the reference pairs (default
// ../shared/data/fusion): mean Qabf, Qcb, Qcv, SSIM, share of patches skipped, and wall and CPU ms
// of a 640x480 pair (best of 7).
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/system/clock.hpp"
#include "core/system/cpu.hpp"
#include "core/system/parallel.hpp"
#include "fusion/cnn_lpif/cnn_lpif.hpp"
#include "fusion/metrics/metrics.hpp"

namespace fs = std::filesystem;
using namespace orbitfuse;
using fusion::CnnLpifOptions;
using fusion::Plane;

namespace {

struct Pair {
  cv::Mat visible, thermal;
};

Plane floats(const cv::Mat& image) {
  Plane plane;
  image.convertTo(plane, CV_32F);
  return plane;
}

std::vector<Pair> load_pairs(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<Pair> pairs;
  for (const fs::path& file : files) {
    const std::string name = file.string();
    if (!name.ends_with("_ir.png")) continue;
    const std::string visible = name.substr(0, name.size() - 6) + "vis.png";
    pairs.push_back(
        {cv::imread(visible, cv::IMREAD_GRAYSCALE), cv::imread(name, cv::IMREAD_GRAYSCALE)});
  }
  return pairs;
}

void show(const std::string& what, const std::vector<Pair>& pairs, const CnnLpifOptions& options) {
  std::map<std::string, double> mean;
  double skipped = 0;
  const auto count = static_cast<double>(pairs.size());
  for (const Pair& pair : pairs) {
    fusion::CnnLpifReport report;
    cv::Mat fused;
    fusion::fuse_cnn_lpif(floats(pair.visible), floats(pair.thermal), options, &report)
        .value()
        .convertTo(fused, CV_8U);
    skipped += report.patches_skipped / count;
    const auto values = fusion_metrics(pair.visible, pair.thermal, fused).value();
    for (const MetricValue& m : values) mean[m.name] += m.value / count;
  }
  Plane v, t;
  cv::resize(floats(pairs[0].visible), v, {640, 480}, 0, 0, cv::INTER_AREA);
  cv::resize(floats(pairs[0].thermal), t, {640, 480}, 0, 0, cv::INTER_AREA);
  double wall_ms = 1e9, cpu_ms = 1e9;
  for (int i = 0; i < 7; ++i) {
    const UsageClock clock;
    if (!fusion::fuse_cnn_lpif(v, t, options)) std::exit(3);
    cpu_ms = std::min(cpu_ms, 1e3 * clock.cpu_s());
    wall_ms = std::min(wall_ms, 1e3 * clock.wall_s());
  }
  fmt::print("| {} | {:.4f} | {:.4f} | {:.1f} | {:.4f} | {:.1f} % | {:.1f} | {:.1f} |\n", what,
             mean["Qabf"], mean["Qcb"], mean["Qcv"], mean["SSIM"], 100 * skipped, wall_ms, cpu_ms);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const fs::path folder = fs::path(argc > 1 ? argv[1] : "../shared/data/fusion") / "pairs";
  const auto pairs = fs::exists(folder) ? load_pairs(folder) : std::vector<Pair>{};
  if (pairs.empty()) {
    fmt::print(stderr, "{}: no pairs; give the folder of the reference pairs\n", folder.string());
    return 3;
  }
  fmt::print(
      "{}, {} threads, {} pairs\n\n| knob | Qabf | Qcb | Qcv | SSIM | skipped | wall ms | CPU ms "
      "|\n"
      "|---|---|---|---|---|---|---|---|\n",
      cpu_description(), thread_count(), pairs.size());
  show("defaults", pairs, {});
  const auto vary = [&](const char* name, auto CnnLpifOptions::*field, auto values) {
    for (const auto value : values) {
      CnnLpifOptions options;
      options.*field = value;
      show(fmt::format("{} {}", name, value), pairs, options);
    }
  };
  vary("network_bands", &CnnLpifOptions::network_bands, std::initializer_list<int>{0, 1, 2, 3, 5});
  vary("vote_px", &CnnLpifOptions::vote_px, std::initializer_list<int>{1, 3, 5, 9});
  vary("match_threshold", &CnnLpifOptions::match_threshold,
       std::initializer_list<double>{0.4, 0.6, 1.0});
  vary("same_within", &CnnLpifOptions::same_within,
       std::initializer_list<double>{0.0, 4.0, 8.0, 16.0});
  return 0;
}
