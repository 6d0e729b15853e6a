// SPDX-License-Identifier: BSD-3-Clause
// A device's way of placing samples, piece by piece, beside march(): what goes on from one piece
// into the next must be shared out as one stretch.
#define ORBITFUSE_ENGINE pieces_alone
#include "recon/nerf/device/march.hpp"

#include <gtest/gtest.h>
#include <cmath>
#include <opencv2/core.hpp>

#include "recon/nerf/rendering/march.hpp"
#include "tests/recon/nerf/mixed_grid.hpp"
#include "tests/recon/nerf/random_ray.hpp"

namespace orbitfuse::nerf {
namespace {

namespace device = pieces_alone;

constexpr int resolution = 32, cascades = 5;

/// Samples of one ray as a device's four steps place them.
Marched placed_in_pieces(const Occupancy& grid, const MarchSettings& settings,
                         const DrawnRay& drawn) {
  device::DeviceRay ray{};
  ray.ray = drawn.ray;
  ray.near = drawn.near, ray.far = drawn.far, ray.jitter = drawn.jitter;
  ray.there = true;
  const int slots = resolution;
  std::vector<device::Segment> segments(static_cast<std::size_t>(device::ray_pieces * slots));
  std::vector<int> counts(device::ray_pieces);
  std::vector<device::PieceSum> sums(device::ray_pieces);
  const device::Stretches found{1, slots, segments.data(), counts.data(), sums.data()};
  const device::Cells cells{grid.resolution, grid.cascades, grid.look.data(), grid.any.data(),
                            grid.plain.data()};
  for (int piece = 0; piece < device::ray_pieces; ++piece)
    device::WalkPieces{cells, settings, &ray, found}(piece);
  SampleSpread spread{};
  int count = 0;
  device::CountSamples{settings, &ray, found, &spread, &count}(0);
  const int first[] = {0, count};
  std::vector<float> t(max_ray_samples + 1), dt(t), s(t), ds(t), before_end(t),
      position(3 * t.size());
  const device::RaySamples samples{first,    t.data(),  dt.data(),
                                   s.data(), ds.data(), {position.data(), max_ray_samples + 1}};
  for (int piece = 0; piece < device::ray_pieces; ++piece)
    device::PlaceSamples{&ray, found, &spread, samples, before_end.data()}(piece);
  for (int k = 0; k < count; ++k)
    device::FinishSamples{&ray, &spread, before_end.data(), max_ray_samples + 1, samples}(k);
  Marched out;
  out.count = spread.count;
  std::copy_n(t.begin(), out.count, out.t);
  std::copy_n(dt.begin(), out.count, out.dt);
  return out;
}

struct Compared {
  int samples = 0, off = 0;
};

/// One ray by both ways. In single precision a ray that grazes an edge may take the other cell.
void compare(const Occupancy& grid, const MarchSettings& settings, const DrawnRay& drawn,
             Compared& all) {
  Marched expected;
  march(grid, settings, &drawn, 1, &expected);
  const Marched found = placed_in_pieces(grid, settings, drawn);
  all.samples += expected.count;
  if (found.count != expected.count) {
    EXPECT_LE(std::abs(found.count - expected.count), 1);
    all.off += expected.count;
    return;
  }
  double length = 0, expected_length = 0;
  for (int k = 0; k < found.count; ++k) {
    ASSERT_TRUE(std::isfinite(found.t[k]) && found.dt[k] >= 0) << k;
    EXPECT_LE(found.t[std::max(k - 1, 0)], found.t[k]) << k;
    all.off += std::abs(found.t[k] - expected.t[k]) > 2e-3f * (1 + expected.t[k]);
    length += found.dt[k];
    expected_length += expected.dt[k];
  }
  EXPECT_NEAR(length, expected_length, 2e-3 * expected_length + 1e-4);
}

Occupancy empty_grid() {
  Occupancy grid;
  grid.create(resolution, cascades);
  grid.on.assign(grid.on.size(), 0);
  return grid;
}

/// Rays from everywhere, through everything, with samples at both ends and the middle of their
/// strata.
Compared compare_rays(const Occupancy& grid, int rays) {
  Compared all;
  cv::RNG random(8);
  for (const float jitter : {0.0f, 0.5f, 1.0f})
    for (int r = 0; r < rays; ++r) {
      DrawnRay drawn;
      test::draw_ray(random, r % 3 == 0 ? 12.0f : 1.5f, drawn.ray);
      drawn.jitter = jitter;
      if (r % 5 == 0) drawn.near = 0.6f;
      if (r % 7 == 0) drawn.far = 3.0f;
      for (const int haze : {8, 100})
        compare(grid, {.near = 0.1f, .surface = 16, .haze = haze}, drawn, all);
    }
  return all;
}

TEST(MarchPieces, AMixOfEmptyPlainAndKnownBlocksIsPlacedAsByTheProcessor) {
  cv::RNG random(21);
  const Occupancy grid = test::mixed_grid(resolution, cascades, random);
  const Compared all = compare_rays(grid, 60);
  EXPECT_GT(all.samples, 5000);
  EXPECT_LT(all.off, all.samples / 50);
}

TEST(MarchPieces, SpaceOfWhichNothingIsKnownIsOneStretchAcrossAllPieces) {
  Occupancy grid = empty_grid();
  grid.on.assign(grid.on.size(), ~std::uint64_t{0});
  grid.refresh();
  const Compared all = compare_rays(grid, 40);
  EXPECT_GT(all.samples, 5000);
  EXPECT_LT(all.off, all.samples / 100);
}

// The ray comes through outer cubes of which nothing is known, whose cells are larger, goes on so
// across borders of pieces, and meets a cell of known density: at every place of its way in turn.
TEST(MarchPieces, APlainStretchGoesOnAcrossBordersUpToAKnownCell) {
  DrawnRay drawn;
  drawn.ray = {{-12.3f, 0.013f, 0.021f}, {1, 0, 0}, 1};
  Compared all;
  for (const float jitter : {0.0f, 0.5f, 1.0f})
    for (int known = 0; known < resolution; ++known) {
      drawn.jitter = jitter;
      Occupancy grid = empty_grid();
      const std::size_t blocks_per_cube = grid.on.size() / cascades;
      std::fill(grid.on.begin() + static_cast<std::ptrdiff_t>(blocks_per_cube), grid.on.end(),
                ~std::uint64_t{0});
      for (int i = 0; i <= known; ++i) {
        const int at[3] = {i, resolution / 2, resolution / 2};
        const std::int64_t cell = grid.index_of(0, at);
        Occupancy::put(grid.on, cell, true);
        if (i == known) grid.density[static_cast<std::size_t>(cell)] = 5;
      }
      grid.refresh();
      compare(grid, {.near = 0.1f, .surface = 16, .haze = 24}, drawn, all);
    }
  EXPECT_GT(all.samples, 1500);
  EXPECT_EQ(all.off, 0);
}

}  // namespace
}  // namespace orbitfuse::nerf
