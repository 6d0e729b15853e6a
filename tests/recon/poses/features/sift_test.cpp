// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/features/sift.hpp"

#include <gtest/gtest.h>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "core/image/image_io.hpp"
#include "core/system/process.hpp"
#include "recon/poses/features/gradients.hpp"
#include "recon/poses/features/scale_space.hpp"
#include "recon/poses/sfm/colmap_database.hpp"
#include "recon/poses/sfm/descriptor_matching.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

/// Blobs and bars of all sizes, the same for a seed.
cv::Mat textured(int width, int height, unsigned seed = 7) {
  cv::Mat image(height, width, CV_8U, cv::Scalar(90));
  cv::RNG random(seed);
  for (int i = 0; i < 220; ++i) {
    const cv::Point at(random.uniform(0, width), random.uniform(0, height));
    const cv::Size size(random.uniform(2, 24), random.uniform(2, 24));
    cv::ellipse(image, at, size, random.uniform(0, 360), 0, 360, random.uniform(0, 256), cv::FILLED,
                cv::LINE_AA);
  }
  cv::GaussianBlur(image, image, {}, 0.8);
  return image;
}

Descriptors floats(const SiftFeatures& features) { return features.descriptors.cast<float>(); }

double turn_between(float a, float b) {
  return std::abs(std::remainder(static_cast<double>(a) - b, 2 * std::numbers::pi));
}

TEST(Sift, FindsWhatColmapsExtractionFinds) {
  const test::TempFolder folder;
  std::filesystem::create_directories(folder / "images");
  const cv::Mat image = textured(320, 240);
  ASSERT_TRUE(write_png(folder / "images" / "a.png", image));
  ASSERT_EQ(
      run_process({"colmap", "feature_extractor", "--database_path", (folder / "db").string(),
                   "--image_path", (folder / "images").string(), "--SiftExtraction.use_gpu", "0",
                   "--SiftExtraction.num_threads", "1", "--SiftExtraction.max_num_features", "400"},
                  folder / "log", "test", {}),
      0);
  const auto pixels = read_keypoints(folder / "db");
  const auto descriptors = read_descriptors(folder / "db");
  ASSERT_TRUE(pixels && descriptors);
  const Eigen::Matrix2Xd& theirs = pixels->at("a.png");
  const Descriptors& their_descriptors = descriptors->at("a.png");
  SiftOptions options;
  options.max_features = 400;
  const SiftFeatures ours = sift_features(image, options);
  ASSERT_GT(theirs.cols(), 400);
  EXPECT_NEAR(static_cast<double>(ours.keypoints.size()), static_cast<double>(theirs.cols()),
              0.01 * static_cast<double>(theirs.cols()));
  int same = 0;
  for (Eigen::Index i = 0; i < theirs.cols(); ++i) {
    bool found = false;
    for (std::size_t k = 0; k < ours.keypoints.size() && !found; ++k) {
      const Eigen::Vector2d at(ours.keypoints[k].x, ours.keypoints[k].y);
      // A 512 long vector; rounding to bytes alone moves it by about 5.
      found = (at - theirs.col(i)).norm() < 0.01 &&
              (ours.descriptors.row(static_cast<Eigen::Index>(k)).cast<float>() -
               their_descriptors.row(i))
                      .norm() < 15;
    }
    same += found ? 1 : 0;
  }
  EXPECT_GT(same, 0.98 * static_cast<double>(theirs.cols())) << "of " << theirs.cols();
}

TEST(Sift, ABlobIsPlacedSizedAndStaysTheSameWhereverItLies) {
  for (const double sigma : {3.0, 5.0, 9.0}) {
    for (const double shift : {0.0, 0.1, 0.4}) {
      const double x0 = 80.5 + shift, y0 = 60.5 - shift;  // two samples that are equal are no peak
      cv::Mat image(128, 160, CV_8U);
      for (int y = 0; y < image.rows; ++y)
        for (int x = 0; x < image.cols; ++x) {
          const double dx = x + 0.5 - x0, dy = 1.1 * (y + 0.5 - y0);
          image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(
              30 + 200 * std::exp(-0.5 * (dx * dx + dy * dy) / (sigma * sigma)));
        }
      const SiftFeatures features = sift_features(image, {});
      // A little longer than wide, or it would have no orientation; eight bits make rings of the
      // blob's foot, which are features too.
      const auto nearest = std::min_element(
          features.keypoints.begin(), features.keypoints.end(), [&](const auto& a, const auto& b) {
            return std::hypot(a.x - x0, a.y - y0) < std::hypot(b.x - x0, b.y - y0);
          });
      ASSERT_NE(nearest, features.keypoints.end()) << sigma;
      EXPECT_NEAR(nearest->x, x0, 0.07) << sigma << " " << shift;
      EXPECT_NEAR(nearest->y, y0, 0.07) << sigma << " " << shift;
      // The difference of two Gaussians, k apart, is strongest on a blob of sqrt(k) times the
      // lower.
      EXPECT_NEAR(nearest->scale_px, sigma / std::pow(2.0, 1.0 / 6), 0.06 * sigma);
    }
  }
}

TEST(Sift, ATurnedImageHasItsFeaturesTurned) {
  const cv::Mat image = textured(200, 160);
  cv::Mat turned;
  cv::rotate(image, turned, cv::ROTATE_90_CLOCKWISE);
  const SiftFeatures a = sift_features(image, {}), b = sift_features(turned, {});
  const auto matches = match_descriptors(floats(a), floats(b));
  ASSERT_GT(static_cast<double>(matches.size()), 0.8 * static_cast<double>(a.keypoints.size()));
  std::size_t right = 0;
  for (const auto& [i, j] : matches) {
    const SiftKeypoint &p = a.keypoints[static_cast<std::size_t>(i)],
                       &q = b.keypoints[static_cast<std::size_t>(j)];
    const double x = image.rows - static_cast<double>(p.y), y = p.x;
    const double turn = turn_between(q.orientation_rad,
                                     p.orientation_rad + static_cast<float>(std::numbers::pi / 2));
    // A doubled image begins half a sample off on the side that was turned away.
    if (std::hypot(q.x - x, q.y - y) < 0.8 && turn < 0.05) ++right;
  }
  EXPECT_GT(static_cast<double>(right), 0.98 * static_cast<double>(matches.size()));
}

TEST(Sift, FinestScalesGoFirstWhenThereAreMoreThanEnough) {
  const cv::Mat image = textured(320, 240);
  const SiftFeatures all = sift_features(image, {.max_features = 100000});
  const SiftFeatures some = sift_features(image, {.max_features = 60});
  ASSERT_GT(all.keypoints.size(), 2 * some.keypoints.size());
  ASSERT_GT(some.keypoints.size(), 60u);
  const std::size_t dropped = all.keypoints.size() - some.keypoints.size();
  for (std::size_t i = 0; i < some.keypoints.size(); ++i) {
    EXPECT_EQ(some.keypoints[i].x, all.keypoints[dropped + i].x);
    EXPECT_EQ(some.keypoints[i].orientation_rad, all.keypoints[dropped + i].orientation_rad);
  }
  EXPECT_EQ(some.descriptors, all.descriptors.bottomRows(some.descriptors.rows()));
}

TEST(Sift, ImagesWithoutFeaturesHaveNone) {
  EXPECT_TRUE(sift_features(cv::Mat(), {}).keypoints.empty());
  for (const cv::Size size :
       {cv::Size(1, 1), {2, 1}, {1, 300}, {300, 2}, {3, 3}, {17, 9}, {64, 48}})
    for (const int level : {0, 17, 255}) {
      const SiftFeatures features = sift_features(cv::Mat(size, CV_8U, cv::Scalar(level)), {});
      EXPECT_TRUE(features.keypoints.empty()) << size << " " << level;
      EXPECT_EQ(features.descriptors.rows(), 0);
    }
  cv::Mat edge(100, 100, CV_8U, cv::Scalar(20));
  edge.colRange(50, 100).setTo(220);
  EXPECT_TRUE(sift_features(edge, {}).keypoints.empty())
      << "a straight edge has no place of its own";
}

TEST(Sift, NoiseAndCutImagesGiveWholeFeatures) {
  cv::Mat noise(97, 131, CV_8U);
  cv::RNG(3).fill(noise, cv::RNG::UNIFORM, 0, 256);
  // A part of a larger image, whose rows lie apart.
  for (const cv::Mat& image : {noise, cv::Mat(noise(cv::Rect(5, 7, 90, 61)))}) {
    const SiftFeatures features = sift_features(image, {.peak_threshold = 0});
    ASSERT_GT(features.keypoints.size(), 25u);
    ASSERT_EQ(features.descriptors.rows(), static_cast<Eigen::Index>(features.keypoints.size()));
    for (const SiftKeypoint& point : features.keypoints) {
      EXPECT_TRUE(point.x >= 0 && point.x <= static_cast<float>(image.cols));
      EXPECT_TRUE(point.y >= 0 && point.y <= static_cast<float>(image.rows));
      EXPECT_TRUE(point.scale_px > 0 && std::isfinite(point.orientation_rad));
    }
    const Eigen::VectorXf lengths = floats(features).rowwise().norm();
    EXPECT_GT(lengths.minCoeff(), 495);
    EXPECT_LT(lengths.maxCoeff(), 529);
  }
  EXPECT_EQ(sift_features(noise(cv::Rect(5, 7, 90, 61)), {}).descriptors,
            sift_features(noise(cv::Rect(5, 7, 90, 61)).clone(), {}).descriptors);
}

TEST(Sift, OptionsOutOfRangeAreNamed) {
  EXPECT_TRUE(SiftOptions{}.validate());
  const auto says = [](const SiftOptions& options) {
    const Status status = options.validate();
    return status ? std::string() : status.error().message();
  };
  EXPECT_NE(says({.max_features = 0}).find("sift.max_features"), std::string::npos);
  EXPECT_NE(says({.peak_threshold = std::nan("")}).find("sift.peak_threshold"), std::string::npos);
  EXPECT_NE(says({.octaves = 0}).find("sift.octaves"), std::string::npos);
}

TEST(SiftGradients, DirectionsAreExactInEveryOctant) {
  for (int degrees = 0; degrees < 360; degrees += 5) {
    const double angle = degrees * std::numbers::pi / 180;
    cv::Mat ramp(9, 13, CV_32F);
    for (int y = 0; y < ramp.rows; ++y)
      for (int x = 0; x < ramp.cols; ++x)
        ramp.at<float>(y, x) =
            static_cast<float>(0.01 * (x * std::cos(angle) + y * std::sin(angle)));
    const Gradients found = gradients(ramp);
    for (int y = 0; y < ramp.rows; ++y)
      for (int x = 0; x < ramp.cols; ++x) {
        EXPECT_NEAR(found.length.at<float>(y, x), 0.01, 1e-6);
        const double off = found.turns.at<float>(y, x) - degrees / 360.0;
        EXPECT_NEAR(std::remainder(off, 1.0), 0, 1e-5) << degrees;
        EXPECT_TRUE(found.turns.at<float>(y, x) >= 0 && found.turns.at<float>(y, x) < 1);
      }
  }
}

TEST(SiftScaleSpace, BlursLikeAGaussianAndKeepsConstants) {
  cv::Mat noise(61, 83, CV_32F), expected;
  cv::RNG(5).fill(noise, cv::RNG::UNIFORM, 0.0f, 1.0f);
  for (const double sigma : {0.7, 1.25, 3.1}) {
    const int side = 2 * static_cast<int>(std::ceil(4 * sigma)) + 1;
    cv::GaussianBlur(noise, expected, {side, side}, sigma, sigma, cv::BORDER_REPLICATE);
    EXPECT_LT(cv::norm(blurred(noise, sigma), expected, cv::NORM_INF), 1e-5) << sigma;
    const cv::Mat flat(5, 3, CV_32F, cv::Scalar(0.25));
    EXPECT_LT(cv::norm(blurred(flat, sigma), flat, cv::NORM_INF), 1e-6);
  }
}

}  // namespace
}  // namespace orbitfuse
