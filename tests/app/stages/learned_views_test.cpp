// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/learned_views.hpp"

#include <gmock/gmock.h>

#include "app/pipeline/stage_record.hpp"
#include "app/stages/artifacts.hpp"
#include "core/formats/colmap_model.hpp"
#include "tests/support/orbit_fixture.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::stages {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class LearnedViewsTest : public ::testing::Test {
 protected:
  LearnedViewsTest() { context_.out = folder_.path(); }
  /// A finished stage of poses that doubts the first so many views.
  void pose(Modality modality, std::size_t doubtful) {
    Reconstruction model = testing_orbit::seen_cube(testing_orbit::two_loops(), 60, 0);
    model.modality = modality;
    const auto folder = context_.of("poses_" + std::string(name(modality)));
    ASSERT_TRUE(write_colmap_model(folder / "model", model, ColmapFormat::binary));
    pipeline::StageRecord record;
    record.output.metrics["doubtful"] = nlohmann::json::array();
    for (std::size_t v = 0; v < doubtful; ++v)
      record.output.metrics["doubtful"].push_back({{"view", model.views[v].name}, {"why", "so"}});
    ASSERT_TRUE(pipeline::write_stage_record(folder, record));
  }
  LearnedViews learned(Modality modality) const {
    auto views = learned_views(context_, modality);
    EXPECT_TRUE(views) << views.error().message();
    return views.value_or(LearnedViews{});
  }

  test::TempFolder folder_;
  pipeline::StageContext context_;
};

TEST_F(LearnedViewsTest, PhotosInDoubtAreLeftOutWithTheirObservations) {
  pose(Modality::visible, 2);
  const LearnedViews views = learned(Modality::visible);
  EXPECT_THAT(views.left_out, ElementsAre("view0", "view1"));
  ASSERT_EQ(views.model.views.size(), 22u);
  EXPECT_FALSE(views.model.points.empty());
  for (const SparsePoint& point : views.model.points) {
    EXPECT_GE(point.track.size(), 2u);
    for (const Observation& o : point.track) {
      ASSERT_LT(o.view, 22);
      // Places moved up by two: the pixel is where the view of that place sees the point.
      const PosedView& view = views.model.views[static_cast<std::size_t>(o.view)];
      const auto seen = view.camera.project(view.cam_from_world * point.position);
      EXPECT_LT((seen - o.pixel).norm(), 0.01) << view.name;
    }
  }
}

TEST_F(LearnedViewsTest, DepthMapsFollowTheirPhotos) {
  pose(Modality::visible, 2);
  const LearnedViews views = learned(Modality::visible);
  const auto posed = load_poses(context_.of("poses_visible"), Modality::visible);
  ASSERT_TRUE(posed);
  std::vector<DepthMap> maps(posed->views.size() + 1);  // the last one of no view
  for (std::size_t i = 0; i < maps.size(); ++i) {
    maps[i].view = static_cast<int>(i);
    maps[i].camera.width = static_cast<int>(i);  // tells it from the others
  }
  const std::vector<DepthMap> followed = of_learned(maps, views);
  ASSERT_EQ(followed.size(), 22u);
  for (const DepthMap& map : followed)
    EXPECT_EQ(views.model.views.at(static_cast<std::size_t>(map.view)).name,
              posed->views.at(static_cast<std::size_t>(map.camera.width)).name);
}

TEST_F(LearnedViewsTest, OfASessionInDoubtAsAWholeAllAreTaken) {
  pose(Modality::visible, 6);
  EXPECT_EQ(learned(Modality::visible).model.views.size(), 18u);
  pose(Modality::visible, 7);
  EXPECT_EQ(learned(Modality::visible).model.views.size(), 24u);
  EXPECT_THAT(learned(Modality::visible).left_out, IsEmpty());
}

TEST_F(LearnedViewsTest, ThermalViewsAreAllTaken) {
  pose(Modality::thermal, 2);
  EXPECT_EQ(learned(Modality::thermal).model.views.size(), 24u);
}

TEST_F(LearnedViewsTest, ADamagedRecordIsAnError) {
  pose(Modality::visible, 2);
  std::filesystem::remove(context_.of("poses_visible") / pipeline::stage_record_file);
  EXPECT_FALSE(learned_views(context_, Modality::visible));
}

}  // namespace
}  // namespace orbitfuse::stages
