// SPDX-License-Identifier: BSD-3-Clause
#include "core/geometry/quarter_turn.hpp"

#include <gtest/gtest.h>

namespace orbitfuse {
namespace {

TEST(QuarterTurn, PosesOfUprightImagesBecomeThoseOfTheImagesAsTaken) {
  Camera taken;
  taken.width = 8, taken.height = 6;
  taken.fx = 9, taken.fy = 7, taken.cx = 3.5, taken.cy = 2.25;
  const Rigid3d taken_from_world{
      Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized())),
      {0.1, -0.2, 3}};
  const Eigen::Vector3d point(0.2, 0.5, 0.3);
  const auto at = [](const cv::Mat& image, const Eigen::Vector2d& pixel) {
    return image.at<uchar>(static_cast<int>(pixel.y()), static_cast<int>(pixel.x()));
  };
  const Eigen::Vector2d seen = taken.project(taken_from_world * point);
  cv::Mat image(taken.height, taken.width, CV_8U, cv::Scalar(0));
  image.at<uchar>(static_cast<int>(seen.y()), static_cast<int>(seen.x())) = 1;
  for (int quarters = 0; quarters < 4; ++quarters) {
    const QuarterTurn turn{quarters};
    const cv::Mat turned = upright(turn, image);
    const Camera camera = upright(turn, taken);
    ASSERT_EQ(turned.size(), cv::Size(camera.width, camera.height)) << quarters;

    // The upright camera's pose is the taken one's, turned the other way.
    const PosedView upright_view = as_taken(turn.back(), {"a", taken, taken_from_world});
    EXPECT_EQ(upright_view.camera, camera) << quarters;
    const Eigen::Vector2d pixel = camera.project(upright_view.cam_from_world * point);
    EXPECT_EQ(at(turned, pixel), 1) << quarters;

    const PosedView again = as_taken(turn, upright_view);
    EXPECT_EQ(again.camera, taken) << quarters;
    EXPECT_LT((again.camera.project(again.cam_from_world * point) - seen).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace orbitfuse
