// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/known/line_misses.hpp"

#include <algorithm>

#include "core/numeric/median.hpp"
#include "recon/poses/index.hpp"

namespace orbitfuse {

std::vector<PairMisses> line_misses(const FeatureGraph& graph, const PairMatches& matches,
                                    const PosedFrames& posed) {
  std::vector<PairMisses> misses;
  for (const auto& [pair, of_pair] : matches) {
    const auto& [a, b] = pair;
    if (!posed.poses[at(a)] || !posed.poses[at(b)]) continue;
    if (camera_center(*posed.poses[at(a)]) == camera_center(*posed.poses[at(b)])) continue;
    const Camera& second = posed.cameras[at(b)];
    const double px = missed_side_px / std::max(second.width, second.height);
    const EpipolarBand band = epipolar_band(graph, pair, posed, 1 / px);
    PairMisses missed{pair, {}};
    for (const auto& [i, j] : of_pair)
      missed.px.push_back(static_cast<float>(band.distance(i, j) / band.half_width));
    misses.push_back(std::move(missed));
  }
  return misses;
}

Held held_of(const PairMisses& misses, double px) {
  const auto held =
      std::count_if(misses.px.begin(), misses.px.end(), [px](float miss) { return miss <= px; });
  return {static_cast<std::size_t>(held), misses.px.size()};
}

Held held_within(const std::vector<PairMisses>& misses, double px) {
  Held sum;
  for (const PairMisses& of_pair : misses) {
    const Held held = held_of(of_pair, px);
    sum.held += held.held, sum.all += held.all;
  }
  return sum;
}

std::vector<Held> held_by_frame(const std::vector<PairMisses>& misses, double px, int frames,
                                const std::vector<bool>& without) {
  std::vector<Held> result(at(frames));
  for (const PairMisses& of_pair : misses) {
    const auto& [a, b] = of_pair.pair;
    if (without[at(a)] || without[at(b)]) continue;
    const Held held = held_of(of_pair, px);
    for (const int f : {a, b}) result[at(f)].held += held.held, result[at(f)].all += held.all;
  }
  return result;
}

double median_miss_px(const std::vector<PairMisses>& misses, double px) {
  std::vector<float> near;
  for (const PairMisses& of_pair : misses)
    for (const float miss : of_pair.px)
      if (miss <= px) near.push_back(miss);
  return static_cast<double>(median_in(near));
}

}  // namespace orbitfuse
