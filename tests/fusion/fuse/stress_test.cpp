// SPDX-License-Identifier: BSD-3-Clause
// Every method on images that leave formulas undefined: a finite answer within the sources' range.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "core/system/parallel.hpp"
#include "fusion/fuse/fuse.hpp"
#include "tests/fusion/fuse/images.hpp"

namespace orbitfuse {
namespace {
using namespace testing;

/// Those whose result lies within the sources' range; heat's colours don't, and are tested apart.
std::vector<std::string> gray_methods() {
  std::vector<std::string> names = fusion_method_names();
  std::erase(names, name(FusionMethod::heat));
  return names;
}

class EveryMethod : public ::testing::TestWithParam<std::string> {
 protected:
  FusionOptions options() const {
    FusionOptions o;
    o.method = fusion_method(GetParam()).value();
    return o;
  }
  cv::Mat fused(const cv::Mat& v, const cv::Mat& t, const cv::Mat& mask = {}) const {
    const auto result = fuse(v, t, mask, options());
    EXPECT_TRUE(result) << result.error().message();
    return result ? *result : cv::Mat();
  }
};

TEST_P(EveryMethod, AwkwardPairsStayNearTheSources) {
  const cv::Size size(64, 48);
  for (const NamedImage& v : awkward_images(size))
    for (const NamedImage& t : awkward_images(size)) {
      const cv::Mat result = fused(v.image, t.image);
      ASSERT_EQ(result.size(), size);
      ASSERT_EQ(result.type(), CV_8UC1);
      if (v.name == t.name) {
        EXPECT_EQ(cv::norm(result, v.image, cv::NORM_INF), 0) << v.name;
      }
      const bool flat = v.name != "noise" && v.name != "checkerboard" && t.name != "noise" &&
                        t.name != "checkerboard" && v.name.find("ramp") == std::string::npos &&
                        t.name.find("ramp") == std::string::npos;
      if (!flat) continue;
      // Two constants: some value between them, the same everywhere.
      double low = 0, high = 0;
      cv::minMaxLoc(result, &low, &high);
      EXPECT_LE(high - low, 1) << v.name << " with " << t.name;
      EXPECT_GE(low, std::min(v.image(0, 0), t.image(0, 0)) - 1);
      EXPECT_LE(high, std::max(v.image(0, 0), t.image(0, 0)) + 1);
    }
}

TEST_P(EveryMethod, OnePixelDifferenceStaysLocal) {
  const cv::Mat1b v = ramp({96, 96});
  cv::Mat1b t = v.clone();
  t(48, 48) = static_cast<uchar>(t(48, 48) ^ 1);
  EXPECT_LE(cv::norm(fused(v, t), v, cv::NORM_INF), 2);
}

TEST_P(EveryMethod, SizesFromSixteenUpAndOddOnes) {
  for (const cv::Size size : {cv::Size(16, 16), cv::Size(17, 16), cv::Size(16, 31),
                              cv::Size(33, 129), cv::Size(101, 47)}) {
    const cv::Mat result = fused(noise(size, 1), noise(size, 2));
    EXPECT_EQ(result.size(), size);
  }
  const auto small = fuse(noise({15, 40}, 1), noise({15, 40}, 2), {}, options());
  ASSERT_FALSE(small);
  EXPECT_EQ(small.error().kind, ErrorKind::input);
}

TEST_P(EveryMethod, ThreadsDoNotChangeABit) {
  const cv::Mat1b v = noise({160, 120}, 1), t = ramp({160, 120});
  set_thread_count(1);
  const cv::Mat one = fused(v, t);
  set_thread_count(4);
  const cv::Mat four = fused(v, t);
  set_thread_count(0);
  EXPECT_EQ(cv::norm(one, four, cv::NORM_INF), 0);
}

TEST_P(EveryMethod, HolesNeverBleed) {
  const cv::Size size(96, 80);
  const cv::Mat1b v = noise(size, 3);
  cv::Mat1b t = ramp(size), mask(size, 255);
  const cv::Rect hole(30, 20, 25, 30);
  mask(hole) = 0;
  const cv::Mat first = fused(v, t, mask);
  t(hole) = 255;
  const cv::Mat second = fused(v, t, mask);
  t(hole) = noise(hole.size(), 9);
  const cv::Mat third = fused(v, t, mask);
  EXPECT_EQ(cv::norm(first, second, cv::NORM_INF), 0) << "what lies in a hole must not matter";
  EXPECT_EQ(cv::norm(first, third, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(first(hole), v(hole), cv::NORM_INF), 0) << "a hole shows the visible image";
}

TEST_P(EveryMethod, ColourIsKept) {
  cv::Mat v(40, 40, CV_8UC3, cv::Scalar(40, 80, 200));
  const cv::Mat1b t(40, 40, static_cast<uchar>(110));
  const cv::Mat result = fused(v, t);
  ASSERT_EQ(result.type(), CV_8UC3);
  const auto p = result.at<cv::Vec3b>(20, 20);
  // Luma changes all channels alike.
  EXPECT_NEAR(p[2] - p[0], 160, 2);
  EXPECT_NEAR(p[1] - p[0], 40, 2);
}

TEST_P(EveryMethod, MistakesAreNamed) {
  const auto sizes = fuse(noise({40, 40}, 1), noise({41, 40}, 2), {}, options());
  ASSERT_FALSE(sizes);
  EXPECT_NE(sizes.error().found.find("41x40"), std::string::npos);
  EXPECT_NE(sizes.error().remedy.find("resize"), std::string::npos);
  const auto floats = fuse(cv::Mat1f::zeros(40, 40), noise({40, 40}, 2), {}, options());
  EXPECT_FALSE(floats);
  const auto hidden =
      fuse(noise({40, 40}, 1), noise({40, 40}, 2), cv::Mat1b::zeros(40, 40), options());
  ASSERT_FALSE(hidden);
  EXPECT_EQ(hidden.error().where, "mask");
}

TEST_P(EveryMethod, SixteenBitSamples) {
  cv::Mat v, t;
  noise({40, 40}, 1).convertTo(v, CV_16U, 257);
  noise({40, 40}, 2).convertTo(t, CV_16U, 257);
  EXPECT_LE(cv::norm(fused(v, t), fused(noise({40, 40}, 1), noise({40, 40}, 2)), cv::NORM_INF), 1);
}

INSTANTIATE_TEST_SUITE_P(Fusion, EveryMethod, ::testing::ValuesIn(gray_methods()),
                         [](const auto& method) {
                           std::string text = method.param;
                           std::replace(text.begin(), text.end(), '-', '_');
                           return text;
                         });

TEST(Planes, NotANumberIsAnError) {
  fusion::Plane v(32, 32, 10.0F), t(32, 32, 20.0F);
  t(3, 4) = std::numeric_limits<float>::quiet_NaN();
  const auto check = [&](const auto& result) {
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().where, "thermal");
  };
  check(fusion::fuse_best(v, t, {}));
  check(fusion::fuse_ms_srif(v, t, {}));
  check(fusion::fuse_pca_msif(v, t, {}));
  t(3, 4) = std::numeric_limits<float>::infinity();
  check(fusion::fuse_cnn_lpif(v, t, {}));
}

}  // namespace
}  // namespace orbitfuse
