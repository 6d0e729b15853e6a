// SPDX-License-Identifier: BSD-3-Clause
#include "recon/alignment/patch_residual.hpp"

#include <gtest/gtest.h>

#include <array>
#include <random>

#include "recon/alignment/pose_correction.hpp"

namespace orbitfuse {
namespace {

Camera camera() {
  Camera c;
  c.width = 640, c.height = 480;
  c.fx = 600, c.fy = 610, c.cx = 320, c.cy = 240;
  return c;
}

/// Correction, log_focal, radial and point in one.
using Parameters = std::array<double, 11>;

std::optional<CorrectedPixel> seen(const Parameters& p) {
  return corrected_pixel(camera(), CorrectedPose(p.data()), p[6], p[7], {p[8], p[9], p[10]});
}

TEST(CorrectedPixel, IsTheCorrectedCamerasOwn) {
  const PoseCorrection correction = {0.1, -0.2, 0.05, 0.3, -0.1, 0.2};
  const Eigen::Vector3d point(0.4, -0.3, 2);
  Camera scaled = camera();
  scaled.fx *= std::exp(0.03), scaled.fy *= std::exp(0.03);
  scaled.k1 = -0.1;
  const auto found = corrected_pixel(camera(), CorrectedPose(correction), 0.03, -0.1, point);
  ASSERT_TRUE(found);
  EXPECT_LT((found->pixel - scaled.project(rigid_of(correction) * point)).norm(), 1e-9);
}

TEST(CorrectedPixel, DerivativesAreThoseOfDifferences) {
  std::mt19937 rng(5);
  std::uniform_real_distribution<double> any(-1, 1);
  // Corrections of next to nothing, of a little, and of nearly half a turn.
  for (const double turn : {0.0, 1e-9, 3e-5, 1e-3, 0.3, 3.0})
    for (int trial = 0; trial < 20; ++trial) {
      Eigen::Vector3d axis(any(rng), any(rng), any(rng));
      axis *= turn / axis.norm();
      Parameters at = {axis.x(),       axis.y(),       axis.z(), 0, 0, 0,
                       0.1 * any(rng), 0.2 * any(rng), 0,        0, 0};
      // Somewhere before the corrected camera.
      const Eigen::Vector3d moved(0.5 * any(rng), 0.5 * any(rng), 2 + any(rng)),
          shift(any(rng), any(rng), any(rng));
      const PoseCorrection pose = {at[0], at[1], at[2], shift.x(), shift.y(), shift.z()};
      const Eigen::Vector3d point = rigid_of(pose).inverse() * moved;
      for (int i = 0; i < 3; ++i) at[static_cast<std::size_t>(3 + i)] = shift[i];
      for (int i = 0; i < 3; ++i) at[static_cast<std::size_t>(8 + i)] = point[i];
      const auto here = seen(at);
      ASSERT_TRUE(here);
      Eigen::Matrix<double, 2, 11> by_hand;
      by_hand << here->by_correction, here->by_log_focal, here->by_radial, here->by_point;
      for (std::size_t k = 0; k < at.size(); ++k) {
        constexpr double step = 1e-6;
        Parameters less = at, more = at;
        less[k] -= step, more[k] += step;
        const auto before = seen(less), after = seen(more);
        ASSERT_TRUE(before && after);
        const Eigen::Vector2d difference = (after->pixel - before->pixel) / (2 * step);
        const auto column = by_hand.col(static_cast<Eigen::Index>(k));
        EXPECT_LT((difference - column).norm(), 1e-4 * (1 + column.norm()))
            << "parameter " << k << ", turned by " << turn;
      }
    }
}

TEST(CorrectedPixel, NothingBehindTheCameraOrOfNoNumber) {
  const PoseCorrection none = {};
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(corrected_pixel(camera(), CorrectedPose(none), 0, 0, {0.1, 0.1, -1}));
  EXPECT_FALSE(corrected_pixel(camera(), CorrectedPose(none), 0, 0, {0.1, 0.1, 0}));
  EXPECT_FALSE(corrected_pixel(camera(), CorrectedPose(none), 0, 0, {0.1, 0.1, nan}));
  const PoseCorrection backwards = {0, 3.14159, 0, 0, 0, 0};
  EXPECT_FALSE(corrected_pixel(camera(), CorrectedPose(backwards), 0, 0, {0.1, 0.1, 1}));
}

TEST(PatchFit, CountsWhatLiesWithinTwoPixelsAndTellsTheirMedian) {
  const PoseCorrection none = {};
  std::vector<PatchMatch> matches;
  for (const double off_px : {0.5, 1.0, 1.5, 2.5, 40.0}) {
    PatchMatch match;
    match.point = {0, 0, 2};
    match.seen = {320 + off_px, 240};
    match.sqrt_weight.setIdentity();
    matches.push_back(match);
  }
  matches.push_back(matches.front());
  matches.back().point.z() = -2;  // behind the camera: no patch of it
  const PatchFit fit = patch_fit(matches, camera(), CorrectedPose(none), 0);
  EXPECT_EQ(fit.matches, 3);
  EXPECT_DOUBLE_EQ(fit.median_px, 1);

  const PatchFit empty = patch_fit({}, camera(), CorrectedPose(none), 0);
  EXPECT_EQ(empty.matches, 0);
  EXPECT_EQ(empty.median_px, 0);
}

}  // namespace
}  // namespace orbitfuse
