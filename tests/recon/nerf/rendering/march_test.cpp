// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/rendering/march.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "tests/recon/nerf/mixed_grid.hpp"
#include "tests/recon/nerf/random_ray.hpp"

namespace orbitfuse::nerf {
namespace {

struct Stretch {
  double begin, length, surface, haze;
};

/// One ray, cell by cell in double precision, without blocks: what march() has to find.
std::vector<Stretch> walk(const Occupancy& grid, const DrawnRay& drawn, double near) {
  std::vector<Stretch> out;
  for (double t = near;;) {
    float x[3];
    for (int d = 0; d < 3; ++d)
      x[d] = static_cast<float>(drawn.ray.origin[d] + t * drawn.ray.direction[d]);
    const int cascade = Occupancy::cascade_of(x);
    if (cascade >= grid.cascades) return out;
    const double size = grid.cell_size(cascade);
    double exit = 1e9;
    for (int d = 0; d < 3; ++d) {
      const double along = drawn.ray.direction[d];
      if (std::abs(along) < 1e-9) continue;
      exit = std::min(exit, ((std::floor(x[d] / size) + (along > 0)) * size - x[d]) / along);
    }
    exit = std::max(exit, 0.0) + 1e-3 * size;
    const std::int64_t cell = grid.cell_of(cascade, x);
    if (Occupancy::test(grid.on, cell)) {
      const int code = grid.code[static_cast<std::size_t>(cell)];
      if (code == 0 && !out.empty() && out.back().surface == 0 &&
          t < out.back().begin + out.back().length + 1e-5) {
        out.back().length += exit;  // what nothing is known of is one stretch
        out.back().haze += exit / size;
        t += exit;
        continue;
      }
      const double depth = exit * densities_of_codes()[std::min(code, 254)];
      out.push_back({t, exit, depth / (1 + depth), exit / size});
    }
    t += exit;
  }
}

/// Distance at which the running sum of what samples are shared out by reaches `part` of the whole.
double distance_at(const std::vector<Stretch>& cells, const MarchSettings& settings, double part) {
  double surface = 0, haze = 0;
  for (const Stretch& s : cells) surface += s.surface, haze += s.haze;
  const double for_surface = settings.surface * std::min(1.0, surface);
  const double for_haze = std::clamp(haze, 2.0, std::max(2.0, static_cast<double>(settings.haze)));
  const double goal = part * (for_surface + for_haze);
  double sum = 0;
  for (const Stretch& s : cells) {
    const double own =
        (surface > 0 ? s.surface * for_surface / surface : 0) + s.haze * for_haze / haze;
    if (sum + own >= goal) return s.begin + s.length * (goal - sum) / own;
    sum += own;
  }
  return cells.back().begin + cells.back().length;
}

TEST(March, SamplesLieWhereADoublePrecisionWalkPutsThem) {
  cv::RNG random(21);
  const Occupancy grid = test::mixed_grid(32, 5, random);
  const MarchSettings settings;
  int samples = 0, off = 0, across = 0;
  for (int group = 0; group < 12; ++group) {
    std::vector<DrawnRay> rays(march_lanes);
    for (DrawnRay& drawn : rays) test::draw_ray(random, 1.5f, drawn.ray);
    std::vector<Marched> out(march_lanes);
    march(grid, settings, rays.data(), march_lanes, out.data());
    for (std::size_t r = 0; r < rays.size(); ++r) {
      const std::vector<Stretch> cells = walk(grid, rays[r], settings.near);
      ASSERT_EQ(cells.empty(), out[r].count == 0);
      double length = 0, covered = 0;
      for (const Stretch& s : cells) length += s.length;
      for (int i = 0; i < out[r].count; ++i) {
        const double expected = distance_at(cells, settings, (i + 0.5) / out[r].count);
        ++samples;
        off += std::abs(out[r].t[i] - expected) > 2e-3 * (1 + expected);
        across += out[r].t[i] > 2;
        covered += out[r].dt[i];
      }
      EXPECT_NEAR(covered, length, 5e-3 * length + 1e-3);
    }
  }
  EXPECT_GT(samples, 1000);
  EXPECT_GT(across, 100) << "in the outer cubes";
  // A ray that grazes an edge may take the other cell in single precision, and shift what follows.
  EXPECT_LT(off, samples / 50);
}

}  // namespace
}  // namespace orbitfuse::nerf
