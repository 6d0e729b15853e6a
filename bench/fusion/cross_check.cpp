// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <limits>

#include "bench/fusion/modes.hpp"

namespace orbitfuse::bench {
namespace {

using Half = std::vector<std::size_t>;

Scores mean_of(const std::vector<Scores>& all, const Half& half) {
  std::vector<Scores> chosen;
  for (const std::size_t i : half) chosen.push_back(all[i]);
  return mean(chosen);
}

/// Best of the three references on each score.
Scores bar_of(const std::map<std::string, std::vector<Scores>>& references, const Half& half) {
  Scores bar{{"Qabf", 0}, {"Qcb", 0}, {"Qcv", std::numeric_limits<double>::max()}};
  for (const char* method : {"CNN", "FPDE", "LP_SR"}) {
    const Scores of_method = mean_of(references.at(method), half);
    bar["Qabf"] = std::max(bar["Qabf"], of_method.at("Qabf"));
    bar["Qcb"] = std::max(bar["Qcb"], of_method.at("Qcb"));
    bar["Qcv"] = std::min(bar["Qcv"], of_method.at("Qcv"));
  }
  return bar;
}

/// How far beyond the bar the worst score is, as a share of the bar.
double margin(const Scores& s, const Scores& bar) {
  return std::min({s.at("Qabf") / bar.at("Qabf") - 1, s.at("Qcb") / bar.at("Qcb") - 1,
                   1 - s.at("Qcv") / bar.at("Qcv")});
}

void print_row(const char* what, const char* on, const fusion::BestOptions& o, const Scores& s,
               const Scores& bar) {
  fmt::print("| {} | {} | {}, {}, {} | {:.4f} ({:.4f}) | {:.4f} ({:.4f}) | {:.1f} ({:.1f}) |\n",
             what, on, o.contrast_kept, o.visible_preference, o.brightness_weight, s.at("Qabf"),
             bar.at("Qabf"), s.at("Qcb"), bar.at("Qcb"), s.at("Qcv"), bar.at("Qcv"));
}

}  // namespace

int cross_check(const std::filesystem::path& folder) {
  const auto pairs = load_pairs(folder);
  const auto references = reference_scores(folder, pairs);
  struct Candidate {
    fusion::BestOptions options;
    std::vector<Scores> scores;
  };
  std::vector<Candidate> candidates;
  for (const double contrast : {0.0, 0.35, 0.7})
    for (const double preference : {0.0, 2.0, 4.0})
      for (const double brightness : {0.0, 0.02, 0.04}) {
        FusionOptions options;
        options.best.contrast_kept = contrast;
        options.best.visible_preference = preference;
        options.best.brightness_weight = brightness;
        candidates.push_back({options.best, scores(pairs, options)});
      }
  Half even, odd;
  for (std::size_t i = 0; i < pairs.size(); ++i) (i % 2 == 0 ? even : odd).push_back(i);
  fmt::print(
      "| chosen on | scored on | contrast kept, visible preference, brightness weight | Qabf (bar) "
      "| Qcb (bar) | Qcv (bar) |\n"
      "|---|---|---|---|---|---|\n");
  const FusionOptions defaults;
  for (const auto& [here, there, here_name, there_name] :
       {std::tuple{&even, &odd, "even pairs", "odd pairs"},
        {&odd, &even, "odd pairs", "even pairs"}}) {
    const Scores bar_here = bar_of(references, *here), bar_there = bar_of(references, *there);
    const auto chosen = std::max_element(candidates.begin(), candidates.end(),
                                         [&](const Candidate& a, const Candidate& b) {
                                           return margin(mean_of(a.scores, *here), bar_here) <
                                                  margin(mean_of(b.scores, *here), bar_here);
                                         });
    print_row(here_name, there_name, chosen->options, mean_of(chosen->scores, *there), bar_there);
    print_row("defaults", there_name, defaults.best, mean_of(scores(pairs, defaults), *there),
              bar_there);
  }
  return 0;
}

}  // namespace orbitfuse::bench
