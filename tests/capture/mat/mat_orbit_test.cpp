// SPDX-License-Identifier: BSD-3-Clause
// The guide on a rendered walk of three loops: changing speed, motion blur, stations that are
// missed and made up for later.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <set>

#include "capture/image_quality/frame_quality.hpp"
#include "capture/live/sharpness_reference.hpp"
#include "capture/mat/mat_finder.hpp"
#include "tests/support/rendered_mat.hpp"

namespace orbitfuse {
namespace {

struct Step {
  double azimuth_deg, elevation_deg, time_s, speed_deg_s;
};

/// Stops at every station but some; walks 15 to 60 degrees a second between them.
std::vector<Step> walk(double elevation_deg, const std::set<int>& missed, double time_s) {
  std::vector<Step> steps;
  const double frame_s = 0.25;
  for (int station = 0; station < 12; ++station) {
    const double azimuth = 30 * station;
    if (!missed.count(station)) {
      for (int i = 0; i < 3; ++i) {
        const double sway = 0.15 * std::sin(3.0 * i + station);
        steps.push_back({azimuth + sway, elevation_deg + sway, time_s, 0.5});
        time_s += frame_s;
      }
    }
    const double speed = 15 + 45 * std::abs(std::sin(1.0 * station));
    for (double along = speed * frame_s; along < 30; along += speed * frame_s) {
      steps.push_back({azimuth + along, elevation_deg, time_s, speed});
      time_s += frame_s;
    }
  }
  return steps;
}

TEST(MatOrbit, EverySectorIsFoundAndNoneFalsely) {
  const MatDesign design{};
  const Camera camera = Camera::from_fov(640, 480, 50);
  const cv::Mat mat = test::printed_mat(black_rectangles(design), design.size_m, 0.0005);
  OrbitPlan plan;
  plan.modalities = {Modality::visible};
  Coverage coverage(plan);
  MatFinder finder(design);
  finder.set_focal_px(Modality::visible, camera.fx);
  std::vector<Step> steps;
  for (const double elevation : {10.0, 30.0, 55.0}) {
    for (const std::set<int>& missed :
         {std::set<int>{2, 7, 8}, std::set<int>{0, 1, 3, 4, 5, 6, 9, 10, 11}}) {
      const auto loop = walk(elevation, missed, steps.empty() ? 0 : steps.back().time_s + 3);
      steps.insert(steps.end(), loop.begin(), loop.end());
    }
  }
  std::optional<OrbitPosition> before;
  double before_s = 0, worst_deg = 0;
  SharpnessReference reference;
  int found = 0, false_green = 0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const Step& step = steps[i];
    cv::Mat image = test::view_of_mat(mat, design.size_m, camera,
                                      test::orbit_pose(step.azimuth_deg, step.elevation_deg, 1.0));
    // 1/60 s of motion across the image.
    const int blur_px = static_cast<int>(step.speed_deg_s / 60 * camera.fx * 0.3 / 57.3);
    if (blur_px > 1) cv::blur(image, image, {blur_px, 1});
    FrameAssessment frame;
    frame.file = std::to_string(i);
    const FrameQuality quality = measure_quality(image);
    frame.rank = quality.sharpness;
    frame.edge_blur = measure_edges(image);
    if (const auto sighting = finder.find(image, Modality::visible)) {
      ++found;
      worst_deg = std::max(worst_deg, std::abs(angle_difference_deg(sighting->position.azimuth_deg,
                                                                    step.azimuth_deg)));
      frame.position = sighting->position;
      frame.position->speed_deg_s = std::numeric_limits<double>::infinity();
      if (before && step.time_s - before_s < 1) {
        frame.position->speed_deg_s =
            angle_difference_deg(frame.position->azimuth_deg, before->azimuth_deg) /
            (step.time_s - before_s);
      }
      before = sighting->position;
      before_s = step.time_s;
    }
    frame.sharpness = reference.relative(quality.sharpness, frame.position);
    if (coverage.add(frame) == Refusal::none) {
      const double off =
          std::abs(angle_difference_deg(step.azimuth_deg, 30 * std::round(step.azimuth_deg / 30)));
      if (off > plan.azimuth_tolerance_deg || step.speed_deg_s > 2.5) ++false_green;
    }
  }
  std::printf(
      "%zu frames, mat found in %d, worst azimuth error %.3f deg, %d of 36 sectors, %d false\n",
      steps.size(), found, worst_deg, coverage.done_count(Modality::visible), false_green);
  EXPECT_LE(worst_deg, 1);
  EXPECT_EQ(coverage.done_count(Modality::visible), 36);
  EXPECT_EQ(false_green, 0);
}

}  // namespace
}  // namespace orbitfuse
