// SPDX-License-Identifier: BSD-3-Clause
#include "recon/depth/dense_depth.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstring>

#include "core/system/parallel.hpp"
#include "tests/support/patterned_floor.hpp"

namespace orbitfuse::depth {
namespace {

using test::arc;
using test::World;

DepthOptions quick() {
  DepthOptions options;
  options.width_px = 160;
  return options;
}

struct Quality {
  double known = 0, good = 0;
};

Quality quality(const World& world, const DenseDepth& found) {
  double known = 0, good = 0, all = 0;
  for (const DepthMap& map : found.maps) {
    const cv::Mat& truth = world.truth[static_cast<std::size_t>(map.view)];
    for (int y = 0; y < map.depth.rows; ++y)
      for (int x = 0; x < map.depth.cols; ++x) {
        const float z = map.depth.at<float>(y, x);
        ++all;
        if (!std::isfinite(z)) continue;
        ++known;
        good += std::abs(z / truth.at<float>(y, x) - 1) < 0.01;
      }
  }
  return {known / all, good / std::max(1.0, known)};
}

TEST(DenseDepth, FindsAPatternedFloorWithoutAnyPoints) {
  const World world = arc(5, 15);
  const auto found = dense_depth(world.model, world.images, quick(), {});
  ASSERT_TRUE(found) << found.error().message();
  const Quality q = quality(world, *found);
  EXPECT_GT(q.known, 0.6);
  EXPECT_GT(q.good, 0.95);
  EXPECT_NEAR(found->report.known, q.known, 1e-9);
}

TEST(DenseDepth, HoldsForAnyUnitOfLengthAndWithDistortion) {
  for (const double scale : {1e-3, 1e4}) {
    const World world = arc(4, 15, scale);
    const auto found = dense_depth(world.model, world.images, quick(), {});
    ASSERT_TRUE(found) << found.error().message();
    const Quality q = quality(world, *found);
    EXPECT_GT(q.known, 0.5) << scale;
    EXPECT_GT(q.good, 0.95) << scale;
  }
  const World bent = arc(4, 15, 1, 160, -0.1);
  const auto found = dense_depth(bent.model, bent.images, quick(), {});
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->maps[0].camera.has_distortion());
  EXPECT_GT(found->report.known, 0.5);
}

TEST(DenseDepth, IsTheSameForOneAndTwoThreads) {
  const World world = arc(3, 15, 1, 96);
  std::vector<DenseDepth> results;
  for (const int threads : {1, 2}) {
    set_thread_count(threads);
    results.push_back(*dense_depth(world.model, world.images, quick(), {}));
  }
  set_thread_count(0);
  for (std::size_t i = 0; i < 3; ++i) {
    const cv::Mat &a = results[0].maps[i].depth, &b = results[1].maps[i].depth;
    ASSERT_EQ(a.size(), b.size());
    EXPECT_EQ(std::memcmp(a.data, b.data, a.total() * 4), 0);
  }
}

TEST(DenseDepth, ConstantImagesHaveNoDepth) {
  World world = arc(3, 15);
  for (cv::Mat& image : world.images) image.setTo(100);
  const auto found = dense_depth(world.model, world.images, quick(), {});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->report.known, 0);
}

TEST(DenseDepth, FlatPartsKeepTheirPlanesAndTheOthersFindTheirs) {
  World world = arc(5, 15);
  for (cv::Mat& image : world.images) image.colRange(0, image.cols / 3).setTo(100);
  const auto found = dense_depth(world.model, world.images, quick(), {});
  ASSERT_TRUE(found) << found.error().message();
  const Quality q = quality(world, *found);
  EXPECT_GT(q.known, 0.3);
  EXPECT_LT(q.known, 0.75);  // nothing is known of what shows nothing
  EXPECT_GT(q.good, 0.95);
}

TEST(DenseDepth, NoParallaxIsAQualityErrorAndBadInputNamesTheView) {
  World one = arc(1, 15);
  auto found = dense_depth(one.model, one.images, quick(), {});
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().kind, ErrorKind::quality);
  const World twins = arc(2, 0);
  found = dense_depth(twins.model, twins.images, quick(), {});
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().kind, ErrorKind::quality);
  found = dense_depth({}, {}, quick(), {});
  ASSERT_FALSE(found);

  World three = arc(3, 15);
  three.images.pop_back();
  EXPECT_FALSE(dense_depth(three.model, three.images, quick(), {}));
  three = arc(3, 15);
  three.images[1] = three.images[1].rowRange(0, 50);
  found = dense_depth(three.model, three.images, quick(), {});
  ASSERT_FALSE(found);
  EXPECT_NE(found.error().message().find("1"), std::string::npos);
  three = arc(3, 15);
  three.model.views[2].cam_from_world.translation.x() = std::nan("");
  EXPECT_FALSE(dense_depth(three.model, three.images, quick(), {}));
  DepthOptions wrong = quick();
  wrong.max_cost = 1.5;
  EXPECT_FALSE(dense_depth(three.model, three.images, wrong, {}));
}

TEST(DenseDepth, SmallAndNarrowImagesAndCancelling) {
  for (const int width : {24, 400}) {
    World world = arc(3, 15, 1, width);
    if (width == 400)
      for (std::size_t i = 0; i < 3; ++i) {  // a strip, reduced to a few rows
        world.images[i] = world.images[i].rowRange(140, 160).clone();
        world.model.views[i].camera.cy -= 140;
        world.model.views[i].camera.height = 20;
      }
    DepthOptions options = quick();
    options.width_px = width == 400 ? 40 : 160;
    const auto found = dense_depth(world.model, world.images, options, {});
    ASSERT_TRUE(found) << found.error().message();
  }
  const World world = arc(3, 15);
  const std::atomic<bool> stop = true;
  Progress progress;
  progress.cancel = &stop;
  const auto found = dense_depth(world.model, world.images, quick(), progress);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().kind, ErrorKind::cancelled);
}

}  // namespace
}  // namespace orbitfuse::depth
