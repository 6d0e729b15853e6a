// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate/refined_tracks.hpp"

#include <gmock/gmock.h>

#include "tests/support/orbit_fixture.hpp"

namespace orbitfuse {
namespace {

using ::testing::HasSubstr;
using testing_orbit::seen_cube;
using testing_orbit::two_loops;

std::vector<cv::Mat> constant_images(const Reconstruction& model) {
  std::vector<cv::Mat> images;
  for (const PosedView& view : model.views)
    images.emplace_back(view.camera.height, view.camera.width, CV_32F, cv::Scalar(90));
  return images;
}

TEST(RefinedTracks, ModelsWhosePatchesAreNotFoundStayAsTheyAre) {
  // Each view keeps what it had, having nothing else: that is no alignment.
  const Reconstruction model = seen_cube(two_loops(), 100, 0.3);
  ASSERT_TRUE(holds_all_views(model));
  const auto refined = aligned_model(model, constant_images(model), {});
  ASSERT_TRUE(refined);
  EXPECT_FALSE(refined->model);
  EXPECT_THAT(refined->found, HasSubstr("0 % moved"));
}

TEST(RefinedTracks, AModelWithDoubtfulViewsIsNotAligned) {
  Reconstruction model = seen_cube(two_loops(), 100, 0.3);
  for (std::size_t i = 20; i < model.points.size(); ++i)
    std::erase_if(model.points[i].track, [](const Observation& seen) { return seen.view == 7; });
  ASSERT_FALSE(holds_all_views(model));
  const auto refined = aligned_model(model, constant_images(model), {});
  ASSERT_TRUE(refined);
  EXPECT_FALSE(refined->model);
  EXPECT_THAT(refined->found, HasSubstr("in doubt"));
}

TEST(RefinedTracks, TooManyObservationsAreLeftAlone) {
  const Reconstruction model = seen_cube(two_loops(), 9000, 0.3);
  const auto refined = aligned_model(model, {}, {});
  ASSERT_TRUE(refined);
  EXPECT_FALSE(refined->model);
  EXPECT_THAT(refined->found, HasSubstr("too many"));
}

}  // namespace
}  // namespace orbitfuse
