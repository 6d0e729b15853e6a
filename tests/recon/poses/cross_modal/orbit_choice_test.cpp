// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/orbit_choice.hpp"

#include <gtest/gtest.h>

#include "core/numeric/median.hpp"
#include "tests/recon/poses/cross_modal/box_orbit.hpp"

namespace orbitfuse {
namespace {

/// Of a camera that was held so that its images need `turn`.
Result<OrbitChoice> choice_of_views_held(QuarterTurn turn) {
  const testing_orbit::BoxOrbit boxes = testing_orbit::box_orbit(true, 160);
  const QuarterTurn held = turn.back();
  std::vector<FrameRecord> frames(boxes.images.size());
  OrbitEvidence evidence{
      {upright(held, boxes.camera), 0.03, 0, false}, testing_orbit::box_lines(true), {}};
  evidence.similar_distance = testing_orbit::box_orbit_radius;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i].file = "view" + std::to_string(i);
    frames[i].station = boxes.stations[i];
    frames[i].width = evidence.lens.camera.width, frames[i].height = evidence.lens.camera.height;
    evidence.frames.push_back(&frames[i]);
    evidence.images.push_back(upright(held, boxes.images[i]));
    evidence.search.push_back(
        {orientation_field(evidence.images.back(), 1.0), evidence.lens.camera});
  }
  const SceneRenderer renderer = testing_orbit::boxes_renderer(true);
  ORBITFUSE_ASSIGN(const OrbitChoice as_is, choose_orbit(renderer, evidence, {}));
  ORBITFUSE_ASSIGN(OrbitChoice choice, choose_turned_orbit(renderer, evidence, {}));
  if (!choice.clearly_better_than(as_is)) choice = as_is;
  std::vector<double> apart_deg;
  for (std::size_t i = 0; i < frames.size(); ++i)
    apart_deg.push_back(rotation_angle_deg(
        choice.selected.alignment.views[i].view.cam_from_world.rotation, boxes.poses[i].rotation));
  EXPECT_LT(median(apart_deg), 2) << "posed as an upright camera's";
  choice.evidence.frames.clear();  // they end here
  return choice;
}

TEST(OrbitChoice, ACameraHeldUprightIsTakenForOne) {
  const auto choice = choice_of_views_held({0});
  ASSERT_TRUE(choice) << choice.error().message();
  EXPECT_EQ(choice->evidence.turn.clockwise, 0);
}

TEST(OrbitChoice, ACameraHeldOnItsSideOrUpsideDownIsFound) {
  for (const int quarters : {2, 3}) {
    const auto choice = choice_of_views_held({quarters});
    ASSERT_TRUE(choice) << choice.error().message();
    EXPECT_EQ(choice->evidence.turn.clockwise, quarters);
  }
}

}  // namespace
}  // namespace orbitfuse
