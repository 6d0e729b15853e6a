// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/rendering/alike_neighbours.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "tests/support/toy_scene.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr float none = std::numeric_limits<float>::quiet_NaN();

/// A plane of one value at one depth whose middle pixel isn't known.
RenderedView plain_view(int channels) {
  RenderedView view;
  view.color = cv::Mat(5, 5, CV_32FC(channels), cv::Scalar::all(0.5));
  view.depth = cv::Mat(5, 5, CV_32FC1, cv::Scalar(2));
  view.opacity = cv::Mat(5, 5, CV_32FC1, cv::Scalar(1));
  for (cv::Mat* plane : {&view.color, &view.depth, &view.opacity})
    (*plane)(cv::Rect(2, 2, 1, 1)).setTo(cv::Scalar::all(none));
  return view;
}

TEST(AlikeNeighbours, GiveTheirMean) {
  for (const int channels : {1, 3}) {
    RenderedView view = plain_view(channels);
    view.color.ptr<float>(2)[1 * channels] = 0.504F;
    view.depth.at<float>(1, 2) = 2.02F;
    ASSERT_TRUE(take_mean(view, 2, 2, beside, 0.01F));
    EXPECT_NEAR(view.color.ptr<float>(2)[2 * channels], 0.501, 1e-6);
    EXPECT_NEAR(view.depth.at<float>(2, 2), 2.005, 1e-6);
    EXPECT_EQ(view.opacity.at<float>(2, 2), 1);
  }
}

TEST(AlikeNeighbours, OfTheSkyGiveSky) {
  RenderedView view = plain_view(3);
  view.depth = none;
  view.opacity = cv::Scalar(0.1);
  ASSERT_TRUE(take_mean(view, 2, 2, diagonal, 0.01F));
  EXPECT_TRUE(std::isnan(view.depth.at<float>(2, 2)));
  EXPECT_NEAR(view.opacity.at<float>(2, 2), 0.1, 1e-6);
}

TEST(AlikeNeighbours, ThatDifferGiveNothing) {
  const auto spoilt = [](const auto& spoil) {
    RenderedView view = plain_view(3);
    spoil(view);
    const bool taken = take_mean(view, 2, 2, beside_by_two, 0.01F);
    EXPECT_TRUE(std::isnan(view.opacity.at<float>(2, 2))) << "a pixel that is not to be touched";
    return !taken;
  };
  EXPECT_TRUE(spoilt([](RenderedView& v) { v.color.at<cv::Vec3f>(2, 4)[2] = 0.52F; }));
  EXPECT_TRUE(spoilt([](RenderedView& v) { v.color.at<cv::Vec3f>(0, 2)[0] = none; }));
  EXPECT_TRUE(spoilt([](RenderedView& v) { v.opacity.at<float>(4, 2) = 0.9F; }));
  EXPECT_TRUE(spoilt([](RenderedView& v) { v.depth.at<float>(2, 0) = 2.1F; }));
  EXPECT_TRUE(spoilt([](RenderedView& v) { v.depth.at<float>(2, 0) = none; }));
}

class QuickPictures : public testing::TestWithParam<Modality> {
 protected:
  static constexpr int pixels = 96;
  Dataset data = test::toy_scene(GetParam(), 8, 1.0, pixels);
  Field field;
  void SetUp() override {
    data.depth = test::toy_depth(data);
    ASSERT_TRUE(train(data, test::toy_options(data.modality, 150), {}, field));
  }
  RenderedView shown(const RenderOptions& options) const {
    return render(field, data.views[1].camera, data.views[1].cam_from_world, options, {}).value();
  }
  /// RMS, as a share of the value range.
  double off(const cv::Mat& a, const cv::Mat& b) const {
    const double range = GetParam() == Modality::visible ? 1 : 15;
    return cv::norm(a, b) / std::sqrt(static_cast<double>(a.total() * a.channels())) / range;
  }
};

/// Every pixel is rendered: where the rays look is all that differs.
TEST_P(QuickPictures, RaysBetweenNeighboursSeeTheSame) {
  const RenderedView all = shown({}), near = shown({.alike = 1e-9, .between_neighbours = true});
  EXPECT_LT(off(near.color, all.color), 0.01);
  EXPECT_LT(off(near.opacity, all.opacity), 0.02);
  EXPECT_GT(cv::norm(near.color, all.color, cv::NORM_INF), 0) << "they looked as they always do";
}

TEST_P(QuickPictures, EveryFourthPixelIsEnoughForAPlainThing) {
  const RenderedView exact = shown({.alike = 1e-9}),
                     quick = shown({.alike = 0.05, .alike_px = 4, .between_neighbours = true});
  EXPECT_LT(off(quick.color, exact.color), 0.015);
  const cv::Mat known = quick.color.reshape(1) == quick.color.reshape(1);
  EXPECT_EQ(cv::countNonZero(known), pixels * pixels * quick.color.channels());
  EXPECT_EQ(cv::countNonZero(quick.opacity >= 0), pixels * pixels);
  // The wider the grid, the fewer of its pixels are rays of their own.
  const RenderedView every_second = shown({.alike = 0.05, .between_neighbours = true});
  const auto own = [&](const RenderedView& view) {
    return cv::countNonZero(cv::abs(view.depth - exact.depth) == 0);
  };
  EXPECT_LE(own(quick), own(every_second));
}

TEST_P(QuickPictures, WhereMoreLightIsLeftTheSurfaceIsNearer) {
  const RenderedView middle = shown({}), before = shown({.surface_light = 0.8});
  EXPECT_EQ(cv::norm(before.color, middle.color, cv::NORM_INF), 0) << "it is the depth's alone";
  const cv::Mat known = middle.depth == middle.depth;
  ASSERT_GT(cv::countNonZero(known), pixels);
  EXPECT_EQ(cv::countNonZero(known & ~(before.depth <= middle.depth)), 0);
  EXPECT_GT(cv::countNonZero(known & (before.depth < middle.depth)), cv::countNonZero(known) / 2);
}

INSTANTIATE_TEST_SUITE_P(Modalities, QuickPictures,
                         testing::Values(Modality::visible, Modality::thermal),
                         [](const auto& of) { return std::string(name(of.param)); });

TEST(RenderOptionsCheck, GridsOtherThanTwoAndFourAreNamed) {
  for (const int px : {-4, 0, 1, 3, 8}) {
    RenderOptions options;
    options.alike_px = px;
    const Status checked = options.validate();
    ASSERT_FALSE(checked) << px;
    EXPECT_EQ(checked.error().where, "render.alike_px");
  }
}

TEST(RenderOptionsCheck, ASurfaceOfTooMuchOrTooLittleLightIsNamed) {
  for (const double light : {0.0, 0.3, 0.99, 1.0, std::nan("")}) {
    RenderOptions options;
    options.surface_light = light;
    const Status checked = options.validate();
    ASSERT_FALSE(checked) << light;
    EXPECT_EQ(checked.error().where, "render.surface_light");
  }
}

}  // namespace
}  // namespace orbitfuse::nerf
