// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/best/halo_rule.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bench/fusion/modes.hpp"
#include "fusion/metrics/metrics.hpp"
#include "tests/support/hot_scenes.hpp"

namespace orbitfuse::bench {
namespace {

using fusion::BestOptions;
using fusion::HaloRule;
using Part = std::vector<std::size_t>;

struct Choice {
  HaloRule rule;
  BestOptions options;
  std::vector<Scores> scores;  // of each pair
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

/// The method without the rule first.
std::vector<Choice> choices() {
  constexpr double contrast_without = 0.5;
  std::vector<Choice> all{{HaloRule::none(), {}, {}}};
  all[0].options.contrast_kept = contrast_without;
  for (const double contrast : {0.2, 0.5})
    for (const float coherence : {400.0F, 3000.0F})
      for (const float lean : {0.0F, 0.15F})
        for (const float heat : {1.0F, 1.5F, 2.0F})
          for (const float mark : {64.0F, 96.0F}) {
            Choice choice;
            choice.rule.coherence = coherence;
            choice.rule.lean = lean;
            choice.rule.least_heat = heat;
            choice.rule.least_mark = mark;
            choice.options.contrast_kept = contrast;
            all.push_back(choice);
          }
  return all;
}

std::string words(const Choice& c) {
  return fmt::format("{}, {}, {}, {}, {}", c.rule.coherence, c.rule.lean, c.rule.least_heat,
                     c.rule.least_mark, c.options.contrast_kept);
}

Scores mean_of(const Choice& choice, const Part& part) {
  std::vector<Scores> chosen;
  for (const std::size_t i : part) chosen.push_back(choice.scores[i]);
  return mean(chosen);
}

/// The least Qcv of those that lose nothing in Qabf and Qcb against the method without the rule.
const Choice& chosen_on(const Part& part, const std::vector<Choice>& all) {
  const Scores without = mean_of(all[0], part);
  const Choice* best = &all[0];
  for (const Choice& choice : all) {
    const Scores s = mean_of(choice, part);
    if (s.at("Qabf") >= without.at("Qabf") && s.at("Qcb") >= without.at("Qcb") &&
        s.at("Qcv") < mean_of(*best, part).at("Qcv"))
      best = &choice;
  }
  return *best;
}

void print_row(const std::string& what, const std::string& constants, const Scores& s) {
  fmt::print("| {} | {} | {:.4f} | {:.4f} | {:.1f} | {:.2f} |\n", what, constants, s.at("Qabf"),
             s.at("Qcb"), s.at("Qcv"), s.at("halo"));
}

/// Every `folds`-th pair from the k-th on is scored with what the others chose.
void cross_validate(const std::vector<Choice>& all, std::size_t folds) {
  std::vector<Scores> held_out;
  std::string constants;
  for (std::size_t fold = 0; fold < folds; ++fold) {
    Part here, there;
    for (std::size_t i = 0; i < all[0].scores.size(); ++i)
      (i % folds == fold ? there : here).push_back(i);
    const Choice& choice = chosen_on(here, all);
    for (const std::size_t i : there) held_out.push_back(choice.scores[i]);
    if (constants.find(words(choice)) == std::string::npos)
      constants += (constants.empty() ? "" : "; ") + words(choice);
  }
  print_row(fmt::format("each of {} parts by the others", folds), constants, mean(held_out));
}

}  // namespace

int halos(const std::filesystem::path& folder) {
  const auto pairs = load_pairs(folder);
  std::vector<Choice> all = choices();
  for (Choice& choice : all)
    for (const Pair& pair : pairs)
      choice.scores.push_back(scores_of(pair.visible, pair.thermal, choice));
  Choice shipped;
  for (const Pair& pair : pairs)
    shipped.scores.push_back(scores_of(pair.visible, pair.thermal, shipped));
  fmt::print(
      "| pairs | coherence, lean, least heat, least mark, contrast kept | Qabf | Qcb | Qcv | halo "
      "|\n|---|---|---|---|---|---|\n");
  for (const Choice& choice : all) print_row("all", words(choice), mean(choice.scores));
  print_row("all", "shipped: " + words(shipped), mean(shipped.scores));
  Part even, odd;
  for (std::size_t i = 0; i < pairs.size(); ++i) (i % 2 == 0 ? even : odd).push_back(i);
  for (const auto& [part, name] : {std::pair{&even, "even"}, {&odd, "odd"}}) {
    print_row(name, "without", mean_of(all[0], *part));
    print_row(name, "shipped", mean_of(shipped, *part));
  }
  for (const std::size_t folds : {std::size_t{2}, std::size_t{3}, std::size_t{6}, pairs.size()})
    cross_validate(all, folds);
  fmt::print("\n| scene | halo without | halo |\n|---|---|---|\n");
  for (const test::HotScene& scene : test::hot_scenes())
    fmt::print("| {} | {:.2f} | {:.2f} |\n", scene.name,
               scores_of(scene.visible, scene.thermal, all[0]).at("halo"),
               scores_of(scene.visible, scene.thermal, shipped).at("halo"));
  return 0;
}

}  // namespace orbitfuse::bench
