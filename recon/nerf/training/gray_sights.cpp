// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/gray_sights.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/geometry/lens_fold.hpp"
#include "core/geometry/lifted.hpp"
#include "recon/nerf/training/confirms.hpp"
#include "recon/nerf/training/even_sample.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr double least_gray = 2, most_gray = 253;  ///< beyond, a camera clipped what it saw
constexpr float gray_edge = 40;                    ///< range of 5x5 pixels: beyond, poses decide
constexpr int least_sight_step_px = 3;             ///< between the points of a depth map
constexpr double most_sights = 33000;
constexpr std::size_t most_askers = 24;

std::optional<LevelSample> level_seen_by(const Dataset& data, const DepthMap& map,
                                         const Eigen::Vector3d& world) {
  const TrainingView& view = data.views[static_cast<std::size_t>(map.view)];
  const Eigen::Vector3d p = view.cam_from_world * world;
  if (!confirms(map, p) || !lens_holds(view.camera, p)) return std::nullopt;
  const auto level = even_sample(view.image, view.camera.project(p), gray_edge);
  if (!level || *level < least_gray || *level > most_gray) return std::nullopt;
  return LevelSample{map.view, *level};
}

}  // namespace

LevelSights level_sights(const Dataset& data, const std::vector<DepthMap>& depth,
                         const std::vector<bool>& heldout) {
  std::vector<const DepthMap*> training, apart;
  double pixels = 0;
  for (const DepthMap& map : depth) {
    const bool trains = !heldout[static_cast<std::size_t>(map.view)];
    (trains ? training : apart).push_back(&map);
    if (trains) pixels += static_cast<double>(map.depth.total());
  }
  const int step =
      std::max(least_sight_step_px, static_cast<int>(std::ceil(std::sqrt(pixels / most_sights))));
  const std::size_t asked = std::min(training.size(), most_askers);
  LevelSights sights;
  for (std::size_t own = 0; own < training.size(); ++own) {
    const DepthMap& map = *training[own];
    const Rigid3d world_from_cam =
        data.views[static_cast<std::size_t>(map.view)].cam_from_world.inverse();
    for (int y = 1; y + 1 < map.depth.rows; y += step)
      for (int x = 1; x + 1 < map.depth.cols; x += step) {
        if (!std::isfinite(map.depth.at<float>(y, x))) continue;
        const Eigen::Vector3d world = world_from_cam * lifted(map.depth, map.camera, x, y);
        LevelSight sight, by_heldout;
        for (std::size_t k = 0; k < asked; ++k)
          if (const auto sample = level_seen_by(
                  data, *training[(own + k * training.size() / asked) % training.size()], world))
            sight.push_back(*sample);
        if (sight.size() < 2) continue;
        for (const DepthMap* other : apart)
          if (const auto sample = level_seen_by(data, *other, world)) by_heldout.push_back(*sample);
        sights.seen.push_back(std::move(sight));
        sights.by_heldout.push_back(std::move(by_heldout));
      }
  }
  return sights;
}

}  // namespace orbitfuse::nerf
