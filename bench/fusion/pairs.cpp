// SPDX-License-Identifier: BSD-3-Clause
#include "bench/fusion/pairs.hpp"

#include <fmt/format.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "fusion/metrics/metrics.hpp"
#include "tests/support/fusion_reference.hpp"

namespace orbitfuse::bench {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void give_up(const std::string& why) {
  fmt::print(stderr, "{}\n", why);
  std::exit(3);
}

}  // namespace

std::vector<Pair> load_pairs(const fs::path& folder) {
  if (!fs::exists(folder / "pairs"))
    give_up(folder.string() + ": no pairs; give the folder of the reference pairs");
  std::vector<Pair> pairs;
  for (const auto& entry : fs::directory_iterator(folder / "pairs")) {
    const std::string file = entry.path().filename().string();
    if (!file.ends_with("_ir.png")) continue;
    const std::string name = file.substr(0, file.size() - 7);
    pairs.push_back(
        {name, cv::imread((folder / "pairs" / (name + "_vis.png")).string(), cv::IMREAD_GRAYSCALE),
         cv::imread(entry.path().string(), cv::IMREAD_GRAYSCALE)});
  }
  if (pairs.empty()) give_up(folder.string() + "/pairs: no NAME_ir.png");
  std::sort(pairs.begin(), pairs.end(),
            [](const Pair& a, const Pair& b) { return a.name < b.name; });
  return pairs;
}

Pair timed_pair(const std::vector<Pair>& pairs) {
  Pair pair{pairs[0].name, {}, {}};
  cv::resize(pairs[0].visible, pair.visible, {640, 480}, 0, 0, cv::INTER_AREA);
  cv::resize(pairs[0].thermal, pair.thermal, {640, 480}, 0, 0, cv::INTER_AREA);
  return pair;
}

std::vector<std::string> scored_methods() {
  std::vector<std::string> names = fusion_method_names();
  std::erase(names, "heat");
  return names;
}

std::map<std::string, std::vector<Scores>> reference_scores(const fs::path& folder,
                                                            const std::vector<Pair>& pairs) {
  std::map<std::string, std::vector<Scores>> result;
  const auto reference = testing::fusion_reference(folder / "reference" / "metrics.csv");
  for (const auto& [key, metrics] : reference) {
    const auto& [pair_name, method] = key;
    const auto found = std::find_if(pairs.begin(), pairs.end(),
                                    [&](const Pair& p) { return p.name == pair_name; });
    if (found == pairs.end()) continue;
    auto& of_method = result[method];
    of_method.resize(pairs.size());
    Scores& of_pair = of_method[static_cast<std::size_t>(found - pairs.begin())];
    of_pair = metrics;
    of_pair["SSIM"] = metrics.at("SSIM_mean");  // VIFB's own is the sum over the sources
  }
  for (auto& [method, of_method] : result)
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const cv::Mat fused =
          cv::imread((folder / "reference" / method / (pairs[i].name + ".png")).string(),
                     cv::IMREAD_GRAYSCALE);
      if (fused.empty()) continue;  // of the trivial methods there are no images
      const auto values = fusion_metrics(pairs[i].visible, pairs[i].thermal, fused).value();
      of_method[i]["halo"] = values.back().value;
    }
  return result;
}

std::vector<Scores> scores(const std::vector<Pair>& pairs, const FusionOptions& options,
                           std::vector<FusionReport>* reports) {
  std::vector<Scores> result;
  for (const Pair& pair : pairs) {
    FusionReport report;
    const auto fused = fuse(pair.visible, pair.thermal, {}, options, &report);
    if (!fused) give_up(pair.name + ": " + fused.error().message());
    if (reports) reports->push_back(std::move(report));
    Scores of_pair;
    const auto values = fusion_metrics(pair.visible, pair.thermal, *fused).value();
    for (const MetricValue& v : values) of_pair[v.name] = v.value;
    result.push_back(std::move(of_pair));
  }
  return result;
}

Scores mean(const std::vector<Scores>& scores) {
  Scores result;
  for (const Scores& s : scores)
    for (const auto& [name, value] : s) result[name] += value / static_cast<double>(scores.size());
  return result;
}

}  // namespace orbitfuse::bench
