// SPDX-License-Identifier: BSD-3-Clause
#include "core/image/undistorted.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <vector>

#include "core/geometry/lifted.hpp"

namespace orbitfuse {
namespace {

using ::testing::HasSubstr;

Camera bent_camera() {
  Camera camera = Camera::from_fov(64, 48, 60);
  camera.k1 = -0.12;
  camera.p1 = 0.003;
  return camera;
}

cv::Mat noise(int type) {
  cv::Mat image(48, 64, type);
  cv::RNG random(5);
  random.fill(image, cv::RNG::UNIFORM, 0, 200);
  return image;
}

TEST(Undistorted, ChannelsTogetherAreChannelsApart) {
  const Camera camera = bent_camera(), straight = camera.without_distortion();
  for (const int type : {CV_8UC3, CV_32FC3}) {
    const cv::Mat image = noise(type);
    std::vector<cv::Mat> apart;
    cv::split(image, apart);
    for (cv::Mat& channel : apart) channel = undistorted(channel, camera, straight);
    cv::Mat merged;
    cv::merge(apart, merged);
    EXPECT_EQ(cv::norm(undistorted(image, camera, straight), merged, cv::NORM_INF), 0) << type;
    EXPECT_GT(cv::norm(image, merged, cv::NORM_INF), 0);
  }
}

TEST(RecordedStraight, GivesWhatALensWithoutDistortionShows) {
  const Camera camera = bent_camera();
  const cv::Mat photo = noise(CV_8UC3);
  const auto straight = recorded_straight(photo, camera, "visible/3.png");
  ASSERT_TRUE(straight);
  EXPECT_EQ(
      cv::norm(*straight, undistorted(photo, camera, camera.without_distortion()), cv::NORM_INF),
      0);
  const auto same = recorded_straight(photo, camera.without_distortion(), "visible/3.png");
  ASSERT_TRUE(same);
  EXPECT_EQ(same->data, photo.data) << "nothing to do";
}

TEST(RecordedStraight, OfAnotherSizeIsAnErrorThatNamesIt) {
  for (Camera camera : {bent_camera(), bent_camera().without_distortion()}) {
    camera.width = 32;
    const auto straight = recorded_straight(noise(CV_8UC3), camera, "visible/3.png");
    ASSERT_FALSE(straight);
    EXPECT_EQ(straight.error().kind, ErrorKind::input);
    EXPECT_EQ(straight.error().where, "visible/3.png");
    EXPECT_THAT(straight.error().found, HasSubstr("64x48"));
    EXPECT_THAT(straight.error().found, HasSubstr("32x48"));
    EXPECT_FALSE(straight.error().remedy.empty());
  }
}

TEST(Lifted, IsThePointThatProjectsBackIntoThePixel) {
  const Camera camera = bent_camera();
  cv::Mat depth(48, 64, CV_32FC1, cv::Scalar(3.5));
  const Eigen::Vector3d point = lifted(depth, camera, 10, 20);
  EXPECT_DOUBLE_EQ(point.z(), 3.5);
  EXPECT_TRUE(camera.project(point).isApprox(Eigen::Vector2d(10.5, 20.5), 1e-9));
  depth.at<float>(20, 10) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(lifted(depth, camera, 10, 20).allFinite());
}

}  // namespace
}  // namespace orbitfuse
