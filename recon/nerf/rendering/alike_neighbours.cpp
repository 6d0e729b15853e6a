// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/rendering/alike_neighbours.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace orbitfuse::nerf {
namespace {

constexpr float alike_depth = 0.03F;  // of it; a step from one surface to another is more

struct Range {
  float low = std::numeric_limits<float>::max(), high = -low, sum = 0;

  void add(float value) {
    low = std::min(low, value);
    high = std::max(high, value);
    sum += value;
  }
  float mean() const { return 0.25F * sum; }
  bool within(float most) const { return high - low <= most && !std::isnan(sum); }
};

}  // namespace

bool take_mean(RenderedView& view, int x, int y, const Neighbours& of, float alike) {
  const int channels = view.color.channels();
  const auto range_of = [&](const cv::Mat& plane, int count, int channel) {
    Range range;
    for (const auto& [dx, dy] : of) range.add(plane.ptr<float>(y + dy)[(x + dx) * count + channel]);
    return range;
  };
  std::array<float, 3> color{};
  for (int c = 0; c < channels; ++c) {
    const Range range = range_of(view.color, channels, c);
    if (!range.within(alike)) return false;
    color[static_cast<std::size_t>(c)] = range.mean();
  }
  const Range opacity = range_of(view.opacity, 1, 0);
  if (!opacity.within(alike)) return false;
  const bool sky = std::all_of(of.begin(), of.end(), [&](const auto& step) {
    return std::isnan(view.depth.at<float>(y + step[1], x + step[0]));
  });
  const Range depth = range_of(view.depth, 1, 0);
  if (!sky && !depth.within(alike_depth * depth.high)) return false;
  std::copy_n(color.data(), channels, view.color.ptr<float>(y) + x * channels);
  view.opacity.at<float>(y, x) = opacity.mean();
  view.depth.at<float>(y, x) = sky ? std::numeric_limits<float>::quiet_NaN() : depth.mean();
  return true;
}

}  // namespace orbitfuse::nerf
