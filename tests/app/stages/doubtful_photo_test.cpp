// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <opencv2/core.hpp>
#include <random>

#include "app/pipeline/runner.hpp"
#include "app/stages/artifacts.hpp"
#include "app/stages/build_stages.hpp"
#include "app/stages/rendered_views.hpp"
#include "core/image/image_io.hpp"
#include "tests/app/cli/session_fixture.hpp"
#include "tests/support/temp_folder.hpp"

// A photo in the wrong place, in the middle of its orbit and in doubt: what the stages after its
// poses make of it together.
namespace orbitfuse::stages {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr std::size_t wrong = 5, claimed = 7;

/// The poses that the session was made with, and points of its cube where views see them.
Reconstruction true_poses(const Session& session) {
  Reconstruction model;
  for (const FrameRecord* frame : session.frames_of(Modality::visible))
    model.views.push_back({frame->file, *frame->camera, *frame->cam_from_world});
  std::mt19937 random(1);
  std::uniform_real_distribution<double> somewhere(-1, 1);
  for (int i = 0; i < 600; ++i) {
    Eigen::Vector3d p(somewhere(random), somewhere(random), somewhere(random));
    const int axis = i % 3;
    p[axis] = i % 2 == 0 ? 1 : -1;
    SparsePoint point;
    point.position = p;
    for (std::size_t v = 0; v < model.views.size(); ++v) {
      const PosedView& view = model.views[v];
      if ((camera_center(view.cam_from_world)[axis] - p[axis]) * p[axis] < 0.5) continue;
      point.track.push_back({static_cast<int>(v), view.camera.project(view.cam_from_world * p)});
    }
    if (point.track.size() >= 2) model.points.push_back(point);
  }
  return model;
}

class DoubtfulPhoto : public ::testing::Test {
 protected:
  void SetUp() override {
    FixtureOptions options;
    options.visible = 16;
    options.thermal = few_thermal;
    write_fixture_session(folder_ / "session", options);
    auto opened = open_session_input(folder_ / "session", {});
    ASSERT_TRUE(opened) << opened.error().message();
    input_ = *std::move(opened);
    truth_ = true_poses(input_.session);
    TrainConfig& visible = config_.train_visible;
    for (TrainConfig* train : {&visible, &config_.train_thermal}) {
      train->options.iterations = 300;
      train->options.eval_count = 0;
      train->options.log2_table = 13;
    }
    config_.render.path.views = 2;
    config_.render.path.width_px = 64;
  }

  /// Runs up to the new views, one photo posed as another was; in doubt or not.
  pipeline::RunSummary run(const std::string& out, bool doubted) {
    std::vector<pipeline::Stage> stages = build_stages(input_, config_);
    stages.at(0).run =
        [&, doubted](const pipeline::StageContext& context) -> Result<pipeline::StageOutput> {
      Reconstruction posed = truth_;
      posed.views[wrong].cam_from_world = truth_.views[claimed].cam_from_world;
      ORBITFUSE_TRY(save_poses(context, input_.session, posed));
      pipeline::StageOutput output;
      output.metrics["doubtful"] = nlohmann::json::array();
      if (doubted)
        output.metrics["doubtful"].push_back({{"view", posed.views[wrong].name}, {"why", "so"}});
      std::vector<std::string> names;
      if (doubted) names.push_back(posed.views[wrong].name);
      ORBITFUSE_TRY(save_pose_frame(context.folder, PoseFrame::visible, names));
      return output;
    };
    pipeline::RunOptions options;
    options.out = folder_ / out;
    options.targets = {"render"};
    return pipeline::Runner(std::move(stages), options, {}).run();
  }

  /// Mean difference of the field and a photo at its true pose, of 255.
  double error_of(const std::string& out, std::size_t photo) const {
    const auto field = nerf::Field::load(folder_ / out / "train_visible" / "field.bin");
    const PosedView& view = truth_.views.at(photo);
    if (!field) return ADD_FAILURE() << field.error().message(), 0;
    const auto rendered = nerf::render(*field, view.camera, view.cam_from_world, {}, {});
    const auto recorded = read_visible(input_.session.folder / view.name);
    if (!rendered || !recorded) return ADD_FAILURE() << view.name, 0;
    cv::Mat difference;
    cv::absdiff(bgr8_of_rgb(rendered->color), *recorded, difference);
    const cv::Scalar mean = cv::mean(difference);
    return (mean[0] + mean[1] + mean[2]) / 3;
  }

  test::TempFolder folder_;
  SessionInput input_;
  RunConfig config_;
  Reconstruction truth_;
};

TEST_F(DoubtfulPhoto, IsLeftOutOfAllThatLearnsFromPhotos) {
  const pipeline::RunSummary summary = run("doubted", true);
  ASSERT_FALSE(summary.error) << summary.error->message();
  const std::string& name = truth_.views[wrong].name;

  // Depth: every other view has its own.
  const auto maps = load_depth_maps(folder_ / "doubted" / "depth");
  ASSERT_TRUE(maps) << maps.error().message();
  int known = 0, right = 0;
  for (const DepthMap& map : *maps) {
    ASSERT_NE(map.view, static_cast<int>(wrong));
    const PosedView& view = truth_.views.at(static_cast<std::size_t>(map.view));
    for (const SparsePoint& point : truth_.points)
      for (const Observation& o : point.track) {
        if (o.view != map.view) continue;
        const Eigen::Vector3d there = view.cam_from_world * point.position;
        const Eigen::Vector2d px = map.camera.project(there);
        const float z = map.depth.at<float>(static_cast<int>(px.y()), static_cast<int>(px.x()));
        if (!std::isfinite(z)) continue;
        ++known;
        right += std::abs(z - there.z()) < 0.2 ? 1 : 0;
      }
  }
  EXPECT_GT(known, 100);
  EXPECT_GT(right, 0.9 * known);

  const pipeline::StageStatus* train = summary.find("train_visible");
  ASSERT_TRUE(train != nullptr && train->done());
  std::string skips;
  for (const Skip& skip : train->output.skips) skips += skip.what + ": " + skip.why + "\n";
  EXPECT_THAT(skips, AllOf(HasSubstr("1 posed photos"), HasSubstr(name)));

  // All posed views are still told, those of the field too.
  pipeline::StageContext trained;
  trained.out = folder_ / "doubted";
  trained.finished = {"train_visible"};
  const auto posed = load_trained_poses(trained, Modality::visible);
  ASSERT_TRUE(posed) << posed.error().message();
  EXPECT_THAT(posed->views, SizeIs(16));

  ASSERT_FALSE(run("believed", false).error);
  // Where the misplaced photo claims to be, the field must have learned of the right one alone.
  EXPECT_LT(error_of("doubted", claimed), 0.75 * error_of("believed", claimed));
}

}  // namespace
}  // namespace orbitfuse::stages
