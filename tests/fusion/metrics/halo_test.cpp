// SPDX-License-Identifier: BSD-3-Clause
// Scenes as they occur: a hot pipe before a plain wall, a cold sky over a street.
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "fusion/metrics/metrics.hpp"

namespace orbitfuse {
namespace {

struct Scene {
  cv::Mat1b visible, thermal;
};

Scene pipe() {
  Scene scene{cv::Mat1b(240, 320, uchar{150}), cv::Mat1b(240, 320, uchar{30})};
  const cv::Rect hot(40, 100, 240, 40);
  scene.visible(hot) = 135;
  scene.thermal(hot) = 250;
  return scene;
}

Scene sky() {
  Scene scene{cv::Mat1b(240, 320, uchar{120}), cv::Mat1b(240, 320, uchar{110})};
  scene.visible.rowRange(0, 110).setTo(215);
  scene.thermal.rowRange(0, 110).setTo(5);
  return scene;
}

double halo_of(const Scene& scene, const cv::Mat& fused) {
  const auto values = fusion_metrics(scene.visible, scene.thermal, fused).value();
  for (const MetricValue& m : values)
    if (m.name == "halo") return m.value;
  ADD_FAILURE() << "no halo";
  return -1;
}

TEST(Halo, NoneInTheSourcesAndInAChoiceAlongTheirEdges) {
  for (const Scene& scene : {pipe(), sky()}) {
    EXPECT_EQ(halo_of(scene, scene.visible), 0);
    EXPECT_EQ(halo_of(scene, scene.thermal), 0);
    EXPECT_EQ(halo_of(scene, cv::max(scene.visible, scene.thermal)), 0);
  }
}

TEST(Halo, AGlowRoundAPipeCounts) {
  const Scene scene = pipe();
  cv::Mat1b fused = cv::max(scene.visible, scene.thermal);
  // Ten rows on each side half way between the wall in one source and in the other.
  fused(cv::Rect(40, 80, 240, 20)) = 90;
  fused(cv::Rect(40, 140, 240, 20)) = 90;
  EXPECT_GT(halo_of(scene, fused), 5);
  fused(cv::Rect(40, 80, 240, 20)) = 10;
  fused(cv::Rect(40, 140, 240, 20)) = 10;
  EXPECT_GT(halo_of(scene, fused), 2) << "darker than both";
}

TEST(Halo, ASkyHalfFromEachCounts) {
  const Scene scene = sky();
  EXPECT_GT(halo_of(scene, (scene.visible + scene.thermal) / 2), 20);
}

TEST(Halo, WithoutEdgesNone) {
  const Scene flat{cv::Mat1b(64, 64, uchar{200}), cv::Mat1b(64, 64, uchar{10})};
  EXPECT_EQ(halo_of(flat, cv::Mat1b(64, 64, uchar{100})), 0);
}

TEST(Halo, SmallestImages) {
  const Scene small{cv::Mat1b(16, 16, uchar{0}), cv::Mat1b(16, 16, uchar{255})};
  EXPECT_EQ(halo_of(small, small.visible), 0);
}

}  // namespace
}  // namespace orbitfuse
