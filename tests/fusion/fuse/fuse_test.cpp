// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/fuse/fuse.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fusion/pyramid/bands.hpp"
#include "fusion/pyramid/pyramid.hpp"
#include "tests/fusion/fuse/images.hpp"

namespace orbitfuse {
namespace {

TEST(FusionMethodNames, RoundTripAndUnknown) {
  for (const std::string& text : fusion_method_names())
    EXPECT_EQ(name(fusion_method(text).value()), text);
  const auto unknown = fusion_method("fancy");
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().kind, ErrorKind::usage);
  EXPECT_NE(unknown.error().remedy.find("ms-srif"), std::string::npos);
}

TEST(Pyramid, CollapseGivesTheImageBack) {
  for (const cv::Size size : {cv::Size(64, 48), cv::Size(33, 17), cv::Size(101, 255)}) {
    fusion::Plane image;
    testing::noise(size, 4).convertTo(image, CV_32F);
    const auto pyramid = fusion::laplacian_pyramid(image, 5);
    EXPECT_EQ(pyramid.bands.size(), 5U);
    EXPECT_LT(cv::norm(fusion::collapse(pyramid), image, cv::NORM_INF), 1e-3);
  }
}

TEST(Pyramid, LevelsStopAtTheSmallestBase) {
  EXPECT_EQ(fusion::pyramid_levels({640, 480}, 4, 8), 4);
  EXPECT_EQ(fusion::pyramid_levels({16, 16}, 4, 8), 1);
  EXPECT_EQ(fusion::pyramid_levels({15, 15}, 4, 8), 1);
  EXPECT_EQ(fusion::pyramid_levels({8, 8}, 4, 8), 0);
}

TEST(Bands, LargerMagnitudeIsTakenLoneSwitchesAreNotAndBordersAreRamps) {
  fusion::Plane v(20, 20, 1.0F), t(20, 20, 0.5F);
  t.colRange(10, 20) = -3;
  v(4, 2) = 0, t(4, 2) = 1.5F;  // a lone switch
  const fusion::Plane share = fusion::share_by_magnitude(v, t);
  EXPECT_EQ(share(4, 2), 1.0F);
  EXPECT_EQ(share(10, 3), 1.0F);
  EXPECT_EQ(share(10, 15), 0.0F);
  for (int x = 1; x < 20; ++x) {
    EXPECT_LE(share(10, x), share(10, x - 1));
    EXPECT_GE(share(10, x), share(10, x - 1) - 0.34F);
  }
}

TEST(FusionOptions, EveryMistakeNamesItsField) {
  const auto where = [](auto change) {
    FusionOptions o;
    change(o);
    const Status status = o.validate();
    return status ? std::string("valid") : status.error().where;
  };
  EXPECT_EQ(where([](auto& o) { o.ms_srif.stride_px = 0; }), "ms_srif.stride_px");
  EXPECT_EQ(where([](auto& o) { o.pca_msif.smoother.time_step = 1.01; }),
            "pca_msif.smoother.time_step");
  EXPECT_EQ(where([](auto& o) { o.cnn_lpif.match_threshold = 2; }), "cnn_lpif.match_threshold");
  EXPECT_EQ(where([](auto& o) { o.best.sharpness = 0; }), "best.sharpness");
  EXPECT_EQ(where([](auto& o) { o.best.contrast_kept = 1.5; }), "best.contrast_kept");
  EXPECT_EQ(where([](auto& o) { o.best.visible_preference = -1; }), "best.visible_preference");
  EXPECT_EQ(where([](auto& o) { o.best.brightness_weight = std::nan(""); }),
            "best.brightness_weight");
  EXPECT_EQ(where([](auto&) {}), "valid");
}

}  // namespace
}  // namespace orbitfuse
