// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/quarter_turn.hpp"

#include <gtest/gtest.h>

namespace orbitfuse {
namespace {

TEST(QuarterTurn, PosesOfUprightImagesBecomeThoseOfTheImagesAsTaken) {
  Camera taken;
  taken.width = 8, taken.height = 6;
  taken.fx = 9, taken.fy = 7, taken.cx = 3.5, taken.cy = 3.25;
  const Rigid3d taken_from_world{
      Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized())),
      {0.1, -0.2, 3}};
  const Eigen::Vector3d point(0.2, 0.5, 0.3);
  const Eigen::Vector2d seen = taken.project(taken_from_world * point);
  for (int quarters = 0; quarters < 4; ++quarters) {
    const QuarterTurn turn{quarters};
    cv::Mat image(taken.height, taken.width, CV_8U, cv::Scalar(0));
    image.at<uchar>(static_cast<int>(seen.y()), static_cast<int>(seen.x())) = 1;
    const cv::Mat turned = upright(turn, image);
    const Camera camera = upright(turn, taken);
    ASSERT_EQ(turned.size(), cv::Size(camera.width, camera.height)) << quarters;

    // Undone by as_taken(), whatever the upright view's pose is.
    const PosedView back = as_taken(turn, {"a", camera, taken_from_world});
    EXPECT_EQ(back.camera, taken) << quarters;
    const Eigen::Vector2d in_upright = camera.project(taken_from_world * point);
    const Eigen::Vector2d in_taken = back.camera.project(back.cam_from_world * point);
    cv::Mat mark(camera.height, camera.width, CV_8U, cv::Scalar(0));
    const int x = static_cast<int>(in_upright.x()), y = static_cast<int>(in_upright.y());
    ASSERT_TRUE(x >= 0 && y >= 0 && x < camera.width && y < camera.height) << quarters;
    mark.at<uchar>(y, x) = 1;
    const cv::Mat as_it_was = upright({(4 - quarters) % 4}, mark);
    EXPECT_EQ(as_it_was.at<uchar>(static_cast<int>(in_taken.y()), static_cast<int>(in_taken.x())),
              1)
        << quarters;
  }
}

}  // namespace
}  // namespace orbitfuse
