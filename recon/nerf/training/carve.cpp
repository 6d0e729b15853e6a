// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/system/parallel.hpp"
#include "recon/nerf/training/plain_background.hpp"
#include "recon/nerf/training/scene.hpp"

namespace orbitfuse::nerf {
namespace {

struct Votes {
  int seen = 0;   ///< views whose image holds the cell
  int free = 0;   ///< ... in front of a known surface there
  int solid = 0;  ///< ... at a known surface
  int sky = 0;    ///< ... with nothing but the sky there, of cells beyond the cameras
};

Votes vote(const std::vector<const NormalisedView*>& voters, const float x[3],
           float half_diagonal) {
  const bool beyond_the_cameras = x[0] * x[0] + x[1] * x[1] + x[2] * x[2] > 1;
  Votes votes;
  for (const NormalisedView* voter : voters) {
    const NormalisedView& view = *voter;
    double px, py, z;
    if (!view.rays.project(x, px, py, z)) continue;
    ++votes.seen;
    const float known = view.distance.at<float>(static_cast<int>(py), static_cast<int>(px));
    if (std::isnan(known)) continue;
    if (std::isinf(known)) {
      // A white roof before a white sky shows no edge; fog stands farther out than the object.
      if (beyond_the_cameras) ++votes.free, ++votes.sky;
      continue;
    }
    float distance = 0;
    for (int d = 0; d < 3; ++d) {
      const float offset = x[d] - static_cast<float>(view.rays.origin()[d]);
      distance += offset * offset;
    }
    distance = std::sqrt(distance);
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
  std::vector<const NormalisedView*> voters;
  std::vector<Silhouette> silhouettes;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (heldout[i]) continue;
    voters.push_back(&views[i]);
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
    for (const NormalisedView* view : voters)
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
