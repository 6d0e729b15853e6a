// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/features/sift.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/option_range.hpp"
#include "recon/poses/features/gradients.hpp"
#include "recon/poses/features/scale_extrema.hpp"
#include "recon/poses/features/scale_space.hpp"

namespace orbitfuse {
namespace {

/// Peaks of one level.
struct PeakLevel {
  std::size_t octave = 0;
  int scale = 0;
  std::vector<ScaleExtremum> peaks;
};

/// From the coarsest level on to the first at which there are more than enough, which is kept
/// whole: finer ones need not be looked at. Finest first.
std::vector<PeakLevel> peak_levels(const std::vector<Octave>& octaves, const SiftOptions& options) {
  std::vector<PeakLevel> levels;
  std::size_t count = 0;
  for (std::size_t o = octaves.size(); o-- > 0;)
    for (int scale = scales_per_octave - 1; scale >= 0; --scale) {
      if (count > static_cast<std::size_t>(options.max_features)) break;
      levels.push_back(
          {o, scale,
           scale_extrema(octaves[o], scale, options.peak_threshold, options.edge_threshold)});
      count += levels.back().peaks.size();
    }
  std::reverse(levels.begin(), levels.end());
  return levels;
}

/// As bytes: roots of the shares (Arandjelovic and Zisserman, CVPR 2012), directions against the
/// turn.
void write_descriptor(const std::array<float, 128>& values, std::uint8_t* bytes) {
  double sum = 0;
  for (const float value : values) sum += value;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double share = sum > 0 ? values[i] / sum : 0;
    const std::size_t direction = i % 8, mirrored = i - direction + (8 - direction) % 8;
    bytes[mirrored] =
        static_cast<std::uint8_t>(std::min(std::lround(512 * std::sqrt(share)), 255L));
  }
}

}  // namespace

Status SiftOptions::validate() const {
  const OptionCheck check("sift");
  ORBITFUSE_TRY(check("max_features", max_features, from_to(1, 1000000)));
  ORBITFUSE_TRY(check("peak_threshold", peak_threshold, from_to(0, 1)));
  ORBITFUSE_TRY(check("edge_threshold", edge_threshold, from_to(1, 1000)));
  ORBITFUSE_TRY(check("octaves", octaves, from_to(1, 16)));
  return check("max_orientations", max_orientations, from_to(1, 4));
}

SiftFeatures sift_features(const cv::Mat& gray, const SiftOptions& options) {
  SiftFeatures features;
  if (gray.empty()) return features;
  std::vector<Octave> octaves = {first_octave(gray)};
  while (static_cast<int>(octaves.size()) < options.octaves) {
    std::optional<Octave> next = next_octave(octaves.back());
    if (!next) break;
    octaves.push_back(std::move(*next));
  }
  std::vector<std::array<float, 128>> descriptors;
  for (const PeakLevel& level : peak_levels(octaves, options)) {
    if (level.peaks.empty()) continue;
    const double spacing = octaves[level.octave].spacing_px;
    const Gradients gradient = gradients(octaves[level.octave].level(level.scale));
    for (const ScaleExtremum& peak : level.peaks) {
      std::vector<float> turns = dominant_turns(gradient, peak);
      turns.resize(std::min(turns.size(), static_cast<std::size_t>(options.max_orientations)));
      for (const float turn : turns) {
        features.keypoints.push_back({static_cast<float>(spacing * peak.x + 0.5),
                                      static_cast<float>(spacing * peak.y + 0.5),
                                      static_cast<float>(spacing * peak.sigma),
                                      static_cast<float>(2 * std::numbers::pi * turn)});
        descriptors.push_back(descriptor(gradient, peak, turn));
      }
    }
  }
  features.descriptors.resize(static_cast<Eigen::Index>(descriptors.size()), 128);
  for (std::size_t i = 0; i < descriptors.size(); ++i)
    write_descriptor(descriptors[i], features.descriptors.row(static_cast<Eigen::Index>(i)).data());
  return features;
}

}  // namespace orbitfuse
