// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "recon/poses/sfm/colmap.hpp"
#include "recon/poses/sfm/descriptor_matching.hpp"
#include "tests/support/temp_folder.hpp"

// A flat surface seen straight and from far to its side, by COLMAP itself.
namespace orbitfuse {
namespace {

constexpr double squeezed = 0.34;  // as seen 70 deg to its side

cv::Mat surface() {
  cv::Mat noise(300, 400, CV_32F), image;
  cv::theRNG().state = 7;
  cv::randu(noise, 0, 255);
  cv::GaussianBlur(noise, noise, {}, 3);
  cv::normalize(noise, image, 0, 255, cv::NORM_MINMAX, CV_8U);
  return image;
}

struct Found {
  int features = 0, right = 0, wrong = 0;
  std::map<std::string, Eigen::Matrix2Xd> places;
};

/// Features of both pictures, and which of their matches are of one place.
Result<Found> matched(bool affine, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder / "images");
  const cv::Mat straight = surface();
  cv::Mat aside;
  cv::resize(straight, aside, {}, squeezed, 1, cv::INTER_AREA);
  cv::copyMakeBorder(aside, aside, 0, 0, 0, straight.cols - aside.cols, cv::BORDER_CONSTANT);
  cv::imwrite(folder / "images/000000.png", straight);
  cv::imwrite(folder / "images/000001.png", aside);
  Session session;
  FrameRecord frames[2];
  std::vector<ProxyImage> images;
  for (int i = 0; i < 2; ++i) {
    frames[i].width = straight.cols, frames[i].height = straight.rows;
    images.push_back(
        {&frames[i], "00000" + std::to_string(i) + ".png", straight.cols, straight.rows});
  }
  ColmapOptions options;
  options.affine_shapes = affine;
  ORBITFUSE_ASSIGN(ColmapProject project,
                   ColmapProject::create(folder / "colmap", folder / "images", options));
  ORBITFUSE_ASSIGN(const DatabaseCounts counts, project.extract(session, images, {}));
  ORBITFUSE_ASSIGN(const auto descriptors, read_descriptors(project.database()));
  Found found;
  ORBITFUSE_ASSIGN(found.places, read_keypoints(project.database()));
  found.features = static_cast<int>(counts.mean_features);
  const Eigen::Matrix2Xd &a = found.places.at(images[0].name), &b = found.places.at(images[1].name);
  for (const auto& [i, j] :
       match_descriptors(descriptors.at(images[0].name), descriptors.at(images[1].name))) {
    const Eigen::Vector2d there(a(0, i) * squeezed, a(1, i));
    ++((there - b.col(j)).norm() < 3 ? found.right : found.wrong);
  }
  return found;
}

TEST(AffineFeatures, AreFoundAgainFromFarToTheSide) {
  const test::TempFolder folder;
  const auto upright = matched(false, folder / "upright");
  if (!upright && upright.error().kind == ErrorKind::unavailable) GTEST_SKIP() << "no COLMAP";
  const auto affine = matched(true, folder / "affine"), again = matched(true, folder / "again");
  ASSERT_TRUE(upright) << upright.error().message();
  ASSERT_TRUE(affine) << affine.error().message();
  ASSERT_TRUE(again) << again.error().message();
  EXPECT_GT(affine->features, upright->features) << "they join the others";
  EXPECT_GT(affine->right, 2 * upright->right + 20);
  EXPECT_LT(affine->wrong, affine->right / 2);
  EXPECT_EQ(affine->places, again->places) << "the same on each run";
}

}  // namespace
}  // namespace orbitfuse
