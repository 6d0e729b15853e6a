// SPDX-License-Identifier: BSD-3-Clause
#include "recon/depth/stereo/patch_match.hpp"

#include <gtest/gtest.h>

#include "tests/support/patterned_floor.hpp"

namespace orbitfuse::depth {
namespace {

constexpr DepthRange range;
constexpr int iterations = 4;

/// The middle view of a floor whose left third is of one colour, and the four views beside it.
class PatchMatch : public testing::Test {
 protected:
  PatchMatch() {
    test::World world = test::arc(5, 15, 1, 96);
    for (std::size_t i = 0; i < world.images.size(); ++i) {
      world.images[i].colRange(0, world.images[i].cols / 3).setTo(100);
      const PosedView& posed = world.model.views[i];
      views.push_back(prepare_view(world.images[i], posed.camera, posed.cam_from_world,
                                   Eigen::Vector3d::Zero(), 1, world.images[i].cols));
    }
    view = views[2];
    for (const std::size_t i : {0, 1, 3, 4}) sources.push_back(source_view(view, views[i]));
    start = random_planes(view, range, {}, 3);
    found = start;
    improve(found, view, sources, range, iterations, {}, 3);
  }

  std::vector<DepthView> views;  ///< the sources point to their pixels
  DepthView view;
  std::vector<SourceView> sources;
  PlaneMap start, found;
};

TEST_F(PatchMatch, PricesAPlaneByAllSourcesThoughItAsksSomeFirst) {
  PlaneMap priced = found;
  improve(priced, view, sources, range, 0, {}, 3);  // only prices: every source is asked
  int sure = 0;
  for (std::size_t i = 0; i < found.cost.size(); ++i) {
    ASSERT_NEAR(found.cost[i], priced.cost[i], 1e-5) << i;
    sure += found.cost[i] < 0.2f;
  }
  EXPECT_GT(sure, 0.3 * static_cast<double>(found.cost.size()));  // those that ask some first
}

TEST_F(PatchMatch, LeavesFlatPixelsTheirPlanesAndMovesTheOthers) {
  int flat = 0, moved = 0, others = 0;
  for (int y = 0; y < found.height; ++y)
    for (int x = 0; x < found.width; ++x) {
      const Plane &was = start.plane[start.at(x, y)], &now = found.plane[found.at(x, y)];
      const bool same = was.depth == now.depth && was.normal == now.normal;
      if (is_flat(reference_patch(view, x, y))) {
        ++flat;
        ASSERT_TRUE(same) << x << ", " << y;
      } else {
        ++others;
        moved += !same;
      }
    }
  EXPECT_GT(flat, 0.2 * found.width * found.height);
  EXPECT_GT(moved, 0.9 * others);
}

TEST_F(PatchMatch, WithoutSourcesChangesNothing) {
  PlaneMap same = start;
  improve(same, view, {}, range, iterations, {}, 3);
  for (std::size_t i = 0; i < start.plane.size(); ++i)
    ASSERT_EQ(same.plane[i].depth, start.plane[i].depth);
}

}  // namespace
}  // namespace orbitfuse::depth
