// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <atomic>

#include "core/system/parallel.hpp"
#include "recon/nerf/field/field_state.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/toy_scene.hpp"

namespace orbitfuse::nerf {
namespace {

using test::toy_options;
using test::toy_scene;

void expect_same_parameters(Field& a, Field& b) {
  const Snapshot left = a.state().snapshot(0), right = b.state().snapshot(0);
  ASSERT_EQ(left.values.size(), right.values.size());
  for (std::size_t i = 0; i < left.values.size(); ++i)
    EXPECT_EQ(left.values[i], right.values[i]) << "set " << i;
  EXPECT_EQ(a.state().occupancy.on, b.state().occupancy.on);
}

TEST(Training, LearnsTheToySceneInBothModalities) {
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    TrainOptions options = toy_options(modality, 200);
    options.holdout_every = 6;
    options.samples_per_step = 1 << 14;
    Field field;
    Dataset data = toy_scene(modality, 18);
    data.depth = test::toy_depth(data);
    const auto report = train(data, options, {}, field);
    ASSERT_TRUE(report) << report.error().message();
    EXPECT_GT(report->best_psnr, 18) << name(modality);
    EXPECT_EQ(report->heldout.size(), 3u);
    const auto view = render(field, data.views[0].camera, data.views[0].cam_from_world, {}, {});
    ASSERT_TRUE(view);
    const int middle = data.views[0].camera.width / 2;
    if (modality == Modality::thermal) {
      EXPECT_NEAR(view->color.at<float>(middle, middle),
                  data.views[0].image.at<float>(middle, middle), 2.0f);
    }
  }
}

TEST(Training, IsTheSameForOneAndTwoThreads) {
  const Dataset data = toy_scene(Modality::visible, 8);
  Field fields[2];
  for (int threads : {1, 2}) {
    set_thread_count(threads);
    ASSERT_TRUE(train(data, toy_options(Modality::visible, 100), {}, fields[threads - 1]));
  }
  set_thread_count(0);
  expect_same_parameters(fields[0], fields[1]);
  TrainOptions other = toy_options(Modality::visible, 100);
  other.seed = 2;
  Field different;
  ASSERT_TRUE(train(data, other, {}, different));
  EXPECT_NE(different.state().color.weights.value, fields[0].state().color.weights.value);
}

/// A view that would spoil a training: absurd values from inside the object, with depth and a
/// point.
void add_hostile_view(Dataset& data, bool first) {
  TrainingView view = data.views[0];
  view.name = "hostile.png";
  view.measure_only = true;
  view.cam_from_world.translation = {0.01, 0.02, 0.03};
  const cv::Scalar value =
      data.modality == Modality::thermal ? cv::Scalar(5000) : cv::Scalar(1, 0, 1);
  view.image = cv::Mat(view.image.size(), view.image.type(), value);
  const int at = first ? 0 : static_cast<int>(data.views.size());
  if (first) {
    for (DepthMap& map : data.depth) ++map.view;
    for (SparsePoint& point : data.points)
      for (Observation& o : point.track) ++o.view;
  }
  data.views.insert(data.views.begin() + at, view);
  for (const float depth : {100.0f, 0.05f})
    data.depth.push_back({at, view.camera, cv::Mat(32, 32, CV_32FC1, cv::Scalar(depth)), {}, {}});
  SparsePoint point;
  point.position = {90, -70, 50};
  point.track = {{at, {3.5, 4.5}}};
  data.points.push_back(point);
}

TEST(Training, AViewThatOnlyMeasuresChangesNothing) {
  for (const Modality modality : {Modality::visible, Modality::thermal})
    for (const bool dense : {true, false}) {
      Dataset data = toy_scene(modality, 6);
      if (dense) data.depth = test::toy_depth(data);
      SparsePoint point;
      point.position = {0, 0, 0.4};
      point.track = {{1, {16.5, 9.5}}, {2, {16.5, 10.5}}};
      data.points.push_back(point);
      TrainOptions options = toy_options(modality, 60);
      options.refine_poses = true;
      options.keep_best = false;
      options.holdout_every = 3;
      for (std::size_t i = 0; modality == Modality::visible && i < data.views.size(); ++i)
        data.views[i].image =
            data.views[i].image * (i % 2 ? 0.6 : 1.0);  // exposures to be evened out
      Field without;
      ASSERT_TRUE(train(data, options, {}, without));
      for (const bool first : {false, true}) {
        Dataset more = data;
        add_hostile_view(more, first);
        Field with;
        const auto report = train(more, options, {}, with);
        ASSERT_TRUE(report) << report.error().message();
        EXPECT_EQ(report->heldout.size(), 3u);
        const FieldState &a = without.state(), &b = with.state();
        EXPECT_EQ(a.main.grid.table.values(), b.main.grid.table.values())
            << name(modality) << first;
        EXPECT_EQ(a.main.mlp.weights.value, b.main.mlp.weights.value);
        EXPECT_EQ(a.color.weights.value, b.color.weights.value);
        EXPECT_EQ(a.occupancy.on, b.occupancy.on);
        EXPECT_EQ(a.occupancy.allowed, b.occupancy.allowed);
        EXPECT_EQ(a.span.low, b.span.low);
        EXPECT_EQ(a.span.high, b.span.high);
        EXPECT_EQ(a.space.radius, b.space.radius);
        for (std::size_t i = 0; i < data.views.size(); ++i)
          EXPECT_EQ(a.image_offsets.value[i], b.image_offsets.value[i + (first ? 1 : 0)]);
      }
    }
}

TEST(Training, ResumedAfterACancelEndsAsAnUnbrokenRun) {
  const orbitfuse::test::TempFolder folder;
  const Dataset data = toy_scene(Modality::thermal, 9);
  TrainOptions options = toy_options(Modality::thermal, 160);
  Field unbroken;
  ASSERT_TRUE(train(data, options, {}, unbroken));

  options.checkpoint = folder / "checkpoint.bin";
  std::atomic<bool> cancel = false;
  Progress progress;
  progress.cancel = &cancel;
  progress.report = [&](const ProgressEvent& event) {
    cancel = event.done >= 80;
  };  // between two turns of the poses
  Field field;
  const auto stopped = train(data, options, progress, field);
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().kind, ErrorKind::cancelled);
  cancel = false;
  options.resume = true;
  progress.report = [](const ProgressEvent&) {};
  const auto resumed = train(data, options, progress, field);
  ASSERT_TRUE(resumed) << resumed.error().message();
  EXPECT_EQ(resumed->iterations, 160);
  expect_same_parameters(unbroken, field);
}

TEST(Training, SavedFieldRendersTheSameAndACutFileIsNamed) {
  const orbitfuse::test::TempFolder folder;
  const Dataset data = toy_scene(Modality::visible, 6);
  Field field;
  ASSERT_TRUE(train(data, toy_options(Modality::visible, 60), {}, field));
  const auto file = folder / "field.bin";
  ASSERT_TRUE(field.save(file));
  auto loaded = Field::load(file);
  ASSERT_TRUE(loaded);
  const TrainingView& view = data.views[1];
  const auto a = render(field, view.camera, view.cam_from_world, {}, {});
  const auto b = render(*loaded, view.camera, view.cam_from_world, {}, {});
  ASSERT_TRUE(a && b);
  EXPECT_EQ(cv::norm(a->color, b->color, cv::NORM_INF), 0);

  const auto size = std::filesystem::file_size(file);
  for (const auto left : {size / 2, size - 1, std::uintmax_t{10}, std::uintmax_t{0}}) {
    const auto part = folder / "part.bin";
    std::filesystem::copy_file(file, part, std::filesystem::copy_options::overwrite_existing);
    std::filesystem::resize_file(part, left);
    const auto cut = Field::load(part);
    ASSERT_FALSE(cut) << left;
    EXPECT_EQ(cut.error().kind, ErrorKind::input);
    EXPECT_NE(cut.error().message().find("part.bin"), std::string::npos);
  }
  EXPECT_FALSE(Field::load(folder / "absent.bin"));
}

TEST(Training, SharedGeometryStartsFromTheGuide) {
  Field guide, with, without;
  ASSERT_TRUE(
      train(toy_scene(Modality::visible, 12), toy_options(Modality::visible, 300), {}, guide));
  const Dataset thermal = toy_scene(Modality::thermal, 12);
  TrainOptions options = toy_options(Modality::thermal, 20);
  ASSERT_TRUE(train(thermal, options, {}, without));
  options.shared_geometry = true;
  const auto error = train(thermal, options, {}, with, nullptr);
  ASSERT_FALSE(error);
  EXPECT_EQ(error.error().kind, ErrorKind::usage);
  ASSERT_TRUE(train(thermal, options, {}, with, &guide));
  const TrainingView& view = thermal.views[0];
  const auto a = render(with, view.camera, view.cam_from_world, {}, {});
  const auto b = render(without, view.camera, view.cam_from_world, {}, {});
  ASSERT_TRUE(a && b);
  EXPECT_LT(cv::norm(a->color, view.image), cv::norm(b->color, view.image));
  options.levels = 4;
  const auto mismatch = train(thermal, options, {}, with, &guide);
  ASSERT_FALSE(mismatch);
  EXPECT_NE(mismatch.error().message().find("nerf.levels"), std::string::npos);
}

TEST(Training, GrayViewsOfACameraOnAutomaticAreBroughtToOneScale) {
  Field guide, field;
  ASSERT_TRUE(train(toy_scene(Modality::visible, 12, 1, 96), toy_options(Modality::visible, 600),
                    {}, guide));
  Dataset gray = toy_scene(Modality::thermal, 12, 1, 96);
  gray.thermal_is_gray = true;
  for (std::size_t i = 0; i < gray.views.size(); ++i) {  // 290 to 305 K, with gains of their own
    const double gain = 8 + 4 * std::sin(2.1 * static_cast<double>(i));
    gray.views[i].image = (gray.views[i].image - 290) * gain + 30;
  }
  TrainOptions options = toy_options(Modality::thermal, 20);
  options.shared_geometry = true;
  const auto even = train(gray, options, {}, field, &guide);
  ASSERT_TRUE(even) << even.error().message();
  ASSERT_EQ(even->gray_curves.size(), gray.views.size());
  // A view of twice the gain has half the slope.
  const auto slope = [&](std::size_t i) {
    const GrayCurve& curve = even->gray_curves.at(gray.views[i].name);
    return curve[5] - curve[2];
  };
  EXPECT_GT(slope(2) / slope(1), 1.3);  // gains of 4.5 and 11.5
  options.even_exposure = false;
  const auto stored = train(gray, options, {}, field, &guide);
  ASSERT_TRUE(stored) << stored.error().message();
  EXPECT_TRUE(stored->gray_curves.empty());
  options.even_exposure = true;
  gray.counts = true;  // of one sensor: no curve was between
  const auto counts = train(gray, options, {}, field, &guide);
  ASSERT_TRUE(counts) << counts.error().message();
  EXPECT_TRUE(counts->gray_curves.empty());
}

TEST(Training, StopsAtATargetAndKeepsTheBestStep) {
  TrainOptions options = toy_options(Modality::visible, 400);
  options.holdout_every = 4;
  options.eval_count = 8;
  options.target_psnr = 13;
  Field field;
  const auto report = train(toy_scene(Modality::visible, 16), options, {}, field);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->stop, StopReason::target_psnr);
  EXPECT_LT(report->iterations, 400);
  EXPECT_GE(report->best_psnr, 13);
}

TEST(Training, ARestoredStepRendersAsItDidThen) {
  const Dataset data = toy_scene(Modality::visible, 6);
  TrainOptions options = toy_options(Modality::visible, 150);
  options.level_anneal_end = 1;  // the finest level is not yet on
  Field field;
  ASSERT_TRUE(train(data, options, {}, field));
  FieldState& state = field.state();
  const auto picture = [&] {
    return render(field, data.views[0].camera, data.views[0].cam_from_world, {}, {})->color;
  };
  const cv::Mat then = picture();
  const Snapshot kept = state.snapshot(20);
  // What later steps change: parameters, which cells are on, where samples go, levels.
  state.each_set([](auto& set) {
    std::vector<float> values = set.values();
    for (float& value : values) value *= 0.5f;
    set.set_values(values);
  });
  for (float& density : state.occupancy.density) density = 1;
  std::fill(state.occupancy.on.begin(), state.occupancy.on.end(), ~std::uint64_t{0});
  std::fill(state.main.grid.level_weight.begin(), state.main.grid.level_weight.end(), 1.0f);
  state.occupancy.refresh();
  state.refresh();
  ASSERT_GT(cv::norm(picture(), then, cv::NORM_INF), 0.01);
  state.restore(kept);
  EXPECT_EQ(cv::norm(picture(), then, cv::NORM_INF), 0);
}

TEST(Options, PresetsHoldThePublishedValues) {
  struct Row {
    const char* name;
    int hidden, color_hidden, features, first, second, fine;
    double distortion;
  };
  for (const Row& row : {Row{"nerfacto", 64, 64, 2, 256, 96, 48, 0.002},
                         Row{"nerf-rgb", 128, 128, 4, 256, 128, 64, 0.002},
                         Row{"nerf-ir", 64, 32, 2, 128, 64, 32, 0.01}}) {
    const TrainOptions o = preset(row.name).value();
    EXPECT_TRUE(o.validate());
    EXPECT_EQ(o.hidden, row.hidden) << row.name;
    EXPECT_EQ(o.color_hidden, row.color_hidden) << row.name;
    EXPECT_EQ(o.features_per_level, row.features) << row.name;
    EXPECT_EQ(o.proposal_samples_1, row.first) << row.name;
    EXPECT_EQ(o.proposal_samples_2, row.second) << row.name;
    EXPECT_EQ(o.fine_samples, row.fine) << row.name;
    EXPECT_EQ(o.distortion_weight, row.distortion) << row.name;
  }
  EXPECT_FALSE(preset("nerfactor"));
  TrainOptions o;
  const auto unknown = o.set("iteration", "3");
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().remedy.find("nerf.iterations"), std::string::npos);
  const auto wrong = o.set("iterations", "many");
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error().message(), "nerf.iterations: 'many'; choose an integer in 1..10000000");
  for (const std::string& key : TrainOptions::keys()) EXPECT_TRUE(o.set(key, o.get(key))) << key;
}

}  // namespace
}  // namespace orbitfuse::nerf
