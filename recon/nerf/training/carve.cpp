// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "core/system/parallel.hpp"
#include "recon/nerf/training/plain_background.hpp"
#include "recon/nerf/training/scene.hpp"

namespace orbitfuse::nerf {
namespace {

struct Votes {
  int seen = 0;   ///< views whose image holds the cell
  int free = 0;   ///< ... in front of a known surface there
  int solid = 0;  ///< ... at a known surface
  int sky = 0;    ///< ... with nothing but the sky there
};

struct Voter {
  const NormalisedView* view;
  cv::Mat sky_px;  ///< CV_32FC1: pixels from here to what isn't sky; empty where there is no sky
};

Voter voter_of(const NormalisedView& view) {
  Voter voter{&view, {}};
  const cv::Mat sky = view.distance == std::numeric_limits<float>::infinity();
  if (cv::countNonZero(sky) > 0) cv::distanceTransform(sky, voter.sky_px, cv::DIST_L2, 3);
  return voter;
}

/// Whether a view shows the sky there and all round. It then sees through the point: one such view
/// is enough. A white roof before a white sky shows no edge: the sky speaks of what stands farther
/// out than the cameras only, as fog does. (With the whole cell before the sky, from two views, fog
/// stays along the horizon: `transformer` .609 K instead of .553.)
bool open_sky(const Voter& voter, const float x[3], int px, int py) {
  constexpr float one_pixel = 1.5f;  // and its neighbours
  return x[0] * x[0] + x[1] * x[1] + x[2] * x[2] > 1 && voter.sky_px.at<float>(py, px) > one_pixel;
}

Votes vote(const std::vector<Voter>& voters, const float x[3], float half_diagonal) {
  Votes votes;
  for (const Voter& voter : voters) {
    const NormalisedView& view = *voter.view;
    double px, py, z;
    if (!view.rays.project(x, px, py, z)) continue;
    ++votes.seen;
    const float known = view.distance.at<float>(static_cast<int>(py), static_cast<int>(px));
    if (std::isnan(known)) continue;
    float distance = 0;
    for (int d = 0; d < 3; ++d) {
      const float offset = x[d] - static_cast<float>(view.rays.origin()[d]);
      distance += offset * offset;
    }
    distance = std::sqrt(distance);
    if (std::isinf(known)) {
      if (open_sky(voter, x, static_cast<int>(px), static_cast<int>(py))) ++votes.free, ++votes.sky;
      continue;
    }
    // The margin covers the cell and 2 % of depth error.
    const float margin = half_diagonal + 0.02f * known;
    if (distance < known - margin) ++votes.free;
    if (std::abs(distance - known) <= margin) ++votes.solid;
  }
  return votes;
}

/// Clears the cells a ray crosses before `end`, and their neighbours within `tube`.
void clear_segment(Occupancy& occupancy, const Ray& ray, float end, float tube) {
  for (float t = 0.02f; t < end;) {
    float x[3];
    for (int d = 0; d < 3; ++d) x[d] = ray.origin[d] + t * ray.direction[d];
    const int cascade = Occupancy::cascade_of(x);
    if (cascade >= occupancy.cascades) return;
    const float size = occupancy.cell_size(cascade);
    const int reach = static_cast<int>(tube * t / size);
    for (int dz = -reach; dz <= reach; ++dz)
      for (int dy = -reach; dy <= reach; ++dy)
        for (int dx = -reach; dx <= reach; ++dx) {
          float y[3] = {x[0] + static_cast<float>(dx) * size, x[1] + static_cast<float>(dy) * size,
                        x[2] + static_cast<float>(dz) * size};
          if (Occupancy::cascade_of(y) != cascade) continue;
          Occupancy::put(occupancy.allowed, occupancy.cell_of(cascade, y), false);
        }
    t += 0.7f * size;
  }
}

}  // namespace

double carve(bool dense_depth, const std::vector<NormalisedView>& views,
             const std::vector<bool>& heldout, const TrainOptions& options, Occupancy& occupancy) {
  std::vector<Voter> voters;
  std::vector<Silhouette> silhouettes;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (heldout[i]) continue;
    voters.push_back(voter_of(views[i]));
    if (!views[i].clearance_px.empty())
      silhouettes.push_back({&views[i].rays, &views[i].clearance_px});
  }
  const int n = occupancy.resolution;
  // Votes are cast for 2x2x2 cells at once; their half diagonal is part of the margin.
  const int half = n / 2;
  const int min_views =
      std::min(static_cast<int>(options.min_views), static_cast<int>(voters.size()));
  std::vector<std::uint8_t> off(static_cast<std::size_t>(half) * half * half * occupancy.cascades);
  parallel_blocks(half * occupancy.cascades, 1, [&](int slab, int) {
    const int cascade = slab / half;
    const float size = 2 * occupancy.cell_size(cascade);
    for (int y = 0; y < half; ++y)
      for (int x = 0; x < half; ++x) {
        const float low = -static_cast<float>(1 << cascade);
        const float center[3] = {low + (static_cast<float>(x) + 0.5f) * size,
                                 low + (static_cast<float>(y) + 0.5f) * size,
                                 low + (static_cast<float>(slab % half) + 0.5f) * size};
        std::uint8_t& off_here = off[(static_cast<std::size_t>(slab) * half + y) * half + x];
        if (sighting_of(silhouettes, center, 0.87f * size) == Sighting::empty) {
          off_here = 1;
          continue;
        }
        const Votes votes = vote(voters, center, 0.87f * size);
        const bool sky = votes.sky > 0 && votes.solid == 0;
        const bool free =
            options.carve && (sky || (votes.free >= 2 && votes.free > 2 * votes.solid));
        off_here = votes.seen < min_views || free;
      }
  });
  for (std::int64_t cell = 0; cell < occupancy.cell_count(); ++cell) {
    int i[3];
    const int cascade = occupancy.coordinates_of(cell, i);  // before i is read
    const std::int64_t slab = std::int64_t{cascade} * half + i[2] / 2;
    if (off[static_cast<std::size_t>((slab * half + i[1] / 2) * half + i[0] / 2)])
      Occupancy::put(occupancy.allowed, cell, false);
  }
  if (options.carve && !dense_depth)
    for (const auto& [view, sky_px] : voters)
      for (const std::int32_t pixel : view->known) {
        const int width = view->rays.camera().width;
        const int x = pixel % width, y = pixel / width;
        Ray ray;
        if (!view->rays.ray(x + 0.5, y + 0.5, ray)) continue;
        const float end = view->distance.at<float>(y, x);
        clear_segment(occupancy, ray, 0.96f * end - 0.02f, 0.03f);
      }
  occupancy.on = occupancy.allowed;
  occupancy.refresh();
  return occupancy.fraction_on();
}

}  // namespace orbitfuse::nerf
