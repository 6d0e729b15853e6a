// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "bench/fusion/modes.hpp"
#include "fusion/best/halo_rule.hpp"
#include "fusion/metrics/metrics.hpp"
#include "tests/support/hot_scenes.hpp"

namespace orbitfuse::bench {
namespace {

using fusion::BestOptions;
using fusion::HaloRule;

struct Choice {
  HaloRule rule;
  BestOptions options;
};

Scores scores_of(const cv::Mat& visible, const cv::Mat& thermal, const Choice& choice) {
  fusion::Plane v, t;
  visible.convertTo(v, CV_32F);
  thermal.convertTo(t, CV_32F);
  cv::Mat fused, v8, t8;
  fusion::fuse_best(v, t, choice.options, choice.rule, nullptr).value().convertTo(fused, CV_8U);
  v.convertTo(v8, CV_8U);
  t.convertTo(t8, CV_8U);
  Scores scores;
  const auto values = fusion_metrics(v8, t8, fused).value();
  for (const MetricValue& m : values) scores[m.name] = m.value;
  return scores;
}

constexpr double contrast_without = 0.5;  // what was best without the rule

std::vector<Choice> choices() {
  std::vector<Choice> all{{HaloRule::none(), {}}};
  all[0].options.contrast_kept = contrast_without;
  for (const double contrast : {0.2, 0.5})
    for (const float coherence : {400.0F, 3000.0F})
      for (const float lean : {0.0F, 0.15F})
        for (const float opposite : {0.0F, 8.0F})
          for (const float heat : {-1.0F, 16.0F, 32.0F, 64.0F}) {
            Choice choice;
            choice.rule.coherence = coherence;
            choice.rule.lean = lean;
            choice.rule.opposite = opposite;
            choice.rule.least_heat = heat;
            choice.options.contrast_kept = contrast;
            all.push_back(choice);
          }
  return all;
}

std::string words(const Choice& c) {
  return fmt::format("{}, {}, {}, {} | {}", c.rule.coherence, c.rule.lean, c.rule.opposite,
                     c.rule.least_heat, c.options.contrast_kept);
}

using Half = std::vector<std::size_t>;
Scores mean_of(const std::vector<Scores>& all, const Half& half) {
  std::vector<Scores> chosen;
  for (const std::size_t i : half) chosen.push_back(all[i]);
  return mean(chosen);
}

void print_row(const std::string& what, const Choice& choice, const Scores& s) {
  fmt::print("| {} | {} | {:.4f} | {:.4f} | {:.1f} | {:.2f} |\n", what, words(choice), s.at("Qabf"),
             s.at("Qcb"), s.at("Qcv"), s.at("halo"));
}

}  // namespace

int halos(const std::filesystem::path& folder) {
  const auto pairs = load_pairs(folder);
  const std::vector<Choice> all = choices();
  std::vector<std::vector<Scores>> table;
  for (const Choice& choice : all) {
    table.emplace_back();
    for (const Pair& pair : pairs)
      table.back().push_back(scores_of(pair.visible, pair.thermal, choice));
  }
  Half whole, even, odd;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    whole.push_back(i);
    (i % 2 == 0 ? even : odd).push_back(i);
  }
  fmt::print(
      "| pairs | coherence, lean, opposite, least heat | contrast kept | Qabf | Qcb | Qcv | halo "
      "|\n|---|---|---|---|---|---|---|\n");
  for (std::size_t i = 0; i < all.size(); ++i) print_row("all", all[i], mean_of(table[i], whole));
  // Least halo of those that lose nothing against the rule without, in Qabf and Qcb, and no more
  // than a fiftieth in Qcv.
  for (const auto& [here, there, name] : {std::tuple{&even, &odd, "chosen on even, of odd"},
                                          {&odd, &even, "chosen on odd, of even"}}) {
    const Scores without = mean_of(table[0], *here);
    std::size_t best = 0;
    double least = std::numeric_limits<double>::max();
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Scores s = mean_of(table[i], *here);
      if (s.at("Qabf") < without.at("Qabf") || s.at("Qcb") < without.at("Qcb") ||
          s.at("Qcv") > 1.02 * without.at("Qcv") || s.at("halo") >= least)
        continue;
      least = s.at("halo");
      best = i;
    }
    print_row(name, all[best], mean_of(table[best], *there));
    print_row("without, of the same", all[0], mean_of(table[0], *there));
  }
  fmt::print("\n| scene | halo without | halo |\n|---|---|---|\n");
  for (const test::HotScene& scene : test::hot_scenes())
    fmt::print("| {} | {:.2f} | {:.2f} |\n", scene.name,
               scores_of(scene.visible, scene.thermal, all[0]).at("halo"),
               scores_of(scene.visible, scene.thermal, {}).at("halo"));
  return 0;
}

}  // namespace orbitfuse::bench
