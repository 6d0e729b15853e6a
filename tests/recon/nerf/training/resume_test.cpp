// SPDX-License-Identifier: BSD-3-Clause
// Runs that go on: after an interruption, and beyond their end.
#include <gtest/gtest.h>

#include "core/system/file_io.hpp"
#include "recon/nerf/field/checkpoint.hpp"
#include "recon/nerf/field/field_state.hpp"
#include "recon/nerf/training/measure.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/toy_scene.hpp"

namespace orbitfuse::nerf {
namespace {

using test::toy_options;
using test::toy_scene;

TrainOptions measured(int iterations) {
  TrainOptions options = toy_options(Modality::visible, iterations);
  options.samples_per_step = 1024;
  options.holdout_every = 3;
  return options;
}

/// A run and what it left, for the tests that only go on from it.
struct Finished {
  orbitfuse::test::TempFolder folder;
  Dataset data = toy_scene(Modality::visible, 6);
  TrainOptions options = measured(40);
  Field field;
  TrainReport report;
  Finished() {
    options.checkpoint = folder / "checkpoint.bin";
    const auto trained = train(data, options, {}, field);
    EXPECT_TRUE(trained);
    if (trained) report = *trained;
    const auto file = folder / "field.bin";
    EXPECT_TRUE(field.save(file));
    EXPECT_TRUE(save_checkpoint(Field::load(file).value(), report, options.checkpoint));
    options.resume = true;
  }
};

TEST(Resume, KeepsTheCurveAndTheCounts) {
  const orbitfuse::test::TempFolder folder;
  const Dataset data = toy_scene(Modality::visible, 9);
  TrainOptions options = measured(160);
  options.eval_count = 8;
  Field unbroken, field;
  const auto whole = train(data, options, {}, unbroken);
  ASSERT_TRUE(whole);

  options.checkpoint = folder / "checkpoint.bin";
  test::StopAt stop(100);
  ASSERT_FALSE(train(data, options, stop.progress, field));
  auto broken_off = Field::load(options.checkpoint);
  ASSERT_TRUE(broken_off);
  EXPECT_GE(broken_off->state().history.curve.size(), 5u);
  broken_off->state().history.skipped_steps = 3;
  ASSERT_TRUE(broken_off->save(options.checkpoint));

  options.resume = true;
  const auto resumed = train(data, options, {}, field);
  ASSERT_TRUE(resumed) << resumed.error().message();
  EXPECT_EQ(resumed->skipped_steps, 3);
  EXPECT_EQ(resumed->rays, whole->rays);
  EXPECT_EQ(resumed->samples, whole->samples);
  EXPECT_EQ(resumed->best_step, whole->best_step);
  ASSERT_EQ(resumed->curve.size(), 8u);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(resumed->curve[i].step, whole->curve[i].step);
    EXPECT_EQ(resumed->curve[i].heldout_psnr, whole->curve[i].heldout_psnr);
    EXPECT_EQ(resumed->curve[i].train_psnr, whole->curve[i].train_psnr);
    if (i > 0) {
      EXPECT_GT(resumed->curve[i].wall_s, resumed->curve[i - 1].wall_s);
    }
  }
}

TEST(Extension, GoesOnFromTheFinishedRunInTheLongerSchedule) {
  Finished run;
  TrainOptions options = run.options;
  options.iterations = 80;
  Field longer;
  const auto report = train(run.data, options, {}, longer);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->iterations, 80);
  EXPECT_GT(report->rays, run.report.rays);
  ASSERT_EQ(report->curve.size(), run.report.curve.size() + 1);  // two a run: 20, 40 and then 80
  EXPECT_EQ(report->curve[1].heldout_psnr, run.report.curve[1].heldout_psnr);
  EXPECT_GT(report->curve[2].wall_s, run.report.wall_s);
  // A later field stands unless it fell by more than views vary.
  EXPECT_GE(report->best_psnr, run.report.best_psnr - 0.3);
  EXPECT_GT(report->curve[2].train_psnr, run.report.curve[1].train_psnr) << "it learned on";
}

TEST(Extension, ByNothingChangesNothingAndAWorseEndKeepsTheField) {
  Finished run;
  const auto same = [&](Field& other) {
    return run.field.state().snapshot(0).values == other.state().snapshot(0).values;
  };
  Field none, worse;
  const auto idle = train(run.data, run.options, {}, none);
  ASSERT_TRUE(idle);
  EXPECT_TRUE(same(none));
  EXPECT_EQ(idle->best_psnr, run.report.best_psnr);
  TrainOptions spoiling = run.options;
  spoiling.iterations = 60;
  spoiling.learning_rate = spoiling.network_learning_rate = 1;
  ASSERT_TRUE(save_checkpoint(Field::load(run.folder / "field.bin").value(), run.report,
                              spoiling.checkpoint));
  const auto report = train(run.data, spoiling, {}, worse);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->iterations, 60);
  EXPECT_EQ(report->best_step, run.report.best_step);
  EXPECT_TRUE(same(worse));
}

TEST(Extension, OfABudgetCountsTheTimeSpent) {
  Finished run;
  TrainOptions options = run.options;
  options.iterations = 100000;
  options.budget_s = run.report.wall_s + 0.2;
  Field field;
  const auto report = train(run.data, options, {}, field);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->stop, StopReason::budget);
  EXPECT_GT(report->iterations, 40);
  EXPECT_GE(report->wall_s, options.budget_s);
  // What was spent is not granted again.
  ASSERT_TRUE(save_checkpoint(Field::load(run.folder / "field.bin").value(), run.report,
                              options.checkpoint));
  options.budget_s = run.report.wall_s;
  const auto spent = train(run.data, options, {}, field);
  ASSERT_TRUE(spent);
  EXPECT_EQ(spent->iterations, 40);
}

TEST(Extension, OfATargetAlreadyReachedEndsAtOnce) {
  Finished run;
  TrainOptions options = run.options;
  options.iterations = 80;
  options.target_psnr = run.report.best_psnr - 1;
  Field field;
  const auto report = train(run.data, options, {}, field);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->stop, StopReason::target_psnr);
  EXPECT_EQ(report->iterations, 40);
}

/// Another value that the option accepts.
TrainOptions altered(const TrainOptions& from, const std::string& key) {
  for (const char* value : {"true", "false", "proposal", "2", "4", "16", "32", "48", "256", "4096",
                            "0.5", "0.25", "1", "0", "elsewhere"}) {
    TrainOptions other = from;
    if (other.set(key, value) && other.get(key) != from.get(key) && other.validate()) return other;
  }
  ADD_FAILURE() << "no other value for " << key;
  return from;
}

TEST(Resume, EveryOptionIsEitherComparedOrFreeToChange) {
  Finished run;
  auto checkpoint = Field::load(run.options.checkpoint);
  ASSERT_TRUE(checkpoint);
  FieldState& state = checkpoint->state();
  for (const std::string& key : TrainOptions::keys()) {
    SCOPED_TRACE(key);
    const TrainOptions other = altered(run.options, key);
    const Status same = check_resumable(state, run.data, state.views, other);
    EXPECT_EQ(same.has_value(), TrainOptions::free_to_change(key));
    if (!same) {
      EXPECT_NE(same.error().found.find("nerf." + key + " = "), std::string::npos)
          << same.error().message();
    }
    // Whatever changes the shape of the parameters or how they came to be from the data is
    // compared.
    FieldState shaped;
    shaped.create(other, state.modality, 6);
    const auto sizes = [](FieldState& of) {
      std::vector<std::size_t> list;
      of.each_set([&](const auto& set) { list.push_back(set.size()); });
      return list;
    };
    bool equal = sizes(state) == sizes(shaped) &&
                 state.occupancy.resolution == shaped.occupancy.resolution &&
                 heldout_views(run.data, other.holdout_every) ==
                     heldout_views(run.data, run.options.holdout_every);
    for (std::size_t l = 0; equal && l < state.main.grid.levels.size(); ++l)
      equal = state.main.grid.levels[l].resolution == shaped.main.grid.levels[l].resolution;
    if (!equal) {
      EXPECT_FALSE(TrainOptions::free_to_change(key));
    }
    if (!TrainOptions::free_to_change(key) || key == "checkpoint" || key == "resume") continue;
    TrainOptions on = other;
    on.iterations = std::max(on.iterations, 42);
    on.checkpoint = run.folder / "other.bin";
    std::filesystem::copy_file(run.options.checkpoint, on.checkpoint,
                               std::filesystem::copy_options::overwrite_existing);
    Field field;
    const auto report = train(run.data, on, {}, field);
    ASSERT_TRUE(report) << report.error().message();
    for (const std::vector<float>& values : field.state().snapshot(0).values)
      EXPECT_TRUE(all_finite(values.data(), values.size()));
  }
}

TEST(Resume, OtherDataAreNamed) {
  Finished run;
  const auto refused = [&](Dataset data, const std::string& why) {
    Field field;
    const auto report = train(data, run.options, {}, field);
    ASSERT_FALSE(report) << why;
    EXPECT_EQ(report.error().kind, ErrorKind::input);
    EXPECT_NE(report.error().where.find("checkpoint.bin"), std::string::npos);
    EXPECT_NE(report.error().found.find(why), std::string::npos) << report.error().message();
  };
  Dataset data = toy_scene(Modality::visible, 7);
  refused(data, "6 views, not 7");
  data = run.data;
  data.views[2].name = "other.png";
  refused(data, "other.png");
  data = run.data;
  data.views[1].measure_only = true;
  refused(data, "001.png training");
  data = run.data;
  data.views[4].image = data.views[4].image.clone();
  data.views[4].image.at<cv::Vec3f>(9, 9)[1] += 0.1f;
  refused(data, "image, camera or pose of 004.png");
  data = run.data;
  data.views[5].cam_from_world.translation.x() += 1e-9;
  refused(data, "image, camera or pose of 005.png");
  data = run.data;
  data.views[5].camera.k1 = 1e-9;
  refused(data, "image, camera or pose of 005.png");
}

/// A field file with its options rewritten by `edit`, which gets and returns (key, value) pairs.
template <class Edit>
void rewrite_options(const std::filesystem::path& from, const std::filesystem::path& to,
                     const Edit& edit) {
  const std::string bytes = read_file(from).value();
  std::size_t at = 8;  // after the magic
  const auto number = [&] {
    std::uint64_t value = 0;
    std::memcpy(&value, &bytes[at], 8);
    at += 8;
    return value;
  };
  const auto word = [&] {
    const std::uint64_t length = number();
    at += length;
    return bytes.substr(at - length, length);
  };
  std::vector<std::pair<std::string, std::string>> options(number());
  for (auto& [key, value] : options) {
    key = word();
    value = word();
  }
  edit(options);
  std::string out = bytes.substr(0, 8);
  const auto put = [&](std::uint64_t value) {
    out.append(reinterpret_cast<const char*>(&value), 8);
  };
  put(options.size());
  for (const auto& [key, value] : options) {
    put(key.size());
    out += key;
    put(value.size());
    out += value;
  }
  out += bytes.substr(at, bytes.size() - 32 - at);
  ASSERT_TRUE(write_file_atomic(to, out + content_hash(out)));
}

TEST(FieldFile, OptionsAreReadByName) {
  Finished run;
  const auto file = run.folder / "field.bin", other = run.folder / "other.bin";
  using Options = std::vector<std::pair<std::string, std::string>>;
  const auto of = [](Options& options, const std::string& key) {
    return std::find_if(options.begin(), options.end(),
                        [&](const auto& o) { return o.first == key; });
  };
  rewrite_options(file, other, [](Options&) {});
  EXPECT_EQ(read_file(other).value(), read_file(file).value()) << "the test reads the format";

  // One that this program has and the file has not: its default.
  rewrite_options(file, other, [&](Options& options) {
    options.erase(of(options, "surface_samples"));
    std::reverse(options.begin(), options.end());
  });
  const auto missing = Field::load(other);
  ASSERT_TRUE(missing) << missing.error().message();
  EXPECT_EQ(missing->state().options.surface_samples, TrainOptions().surface_samples);
  EXPECT_EQ(missing->state().options.log2_table, 12);

  const auto refused = [&](const std::string& why) {
    const auto field = Field::load(other);
    ASSERT_FALSE(field) << why;
    EXPECT_EQ(field.error().kind, ErrorKind::input);
    EXPECT_NE(field.error().where.find("other.bin"), std::string::npos);
    EXPECT_NE(field.error().found.find(why), std::string::npos) << field.error().message();
  };
  rewrite_options(file, other, [](Options& options) { options.emplace_back("warp", "3"); });
  refused("nerf.warp");
  rewrite_options(file, other, [&](Options& options) { of(options, "levels")->second = "many"; });
  refused("nerf.levels is 'many'");
  rewrite_options(file, other, [&](Options& options) { of(options, "levels")->second = "99"; });
  refused("nerf.levels: 99");
  rewrite_options(file, other, [&](Options& options) { of(options, "levels")->second = "4"; });
  refused("malformed content");
  // Tables of gigabytes, of which the file holds nothing: refused before memory is taken.
  rewrite_options(file, other, [&](Options& options) {
    of(options, "levels")->second = "16";
    of(options, "log2_table")->second = "22";
    of(options, "max_resolution")->second = "8192";
  });
  refused("cut short");
}

TEST(FieldFile, BytesThatAreNoModalityAreRefused) {
  Finished run;
  std::string bytes = read_file(run.options.checkpoint).value();
  bytes.resize(bytes.size() - 32);
  // The modality follows the last option's value.
  const std::string key = TrainOptions::keys().back();
  const std::string value = Field::load(run.options.checkpoint)->state().options.get(key);
  const std::size_t at = bytes.find(key) + key.size() + 8 + value.size();
  ASSERT_EQ(bytes[at + 1] | bytes[at + 2] | bytes[at + 3], 0) << "the test reads the format";
  bytes[at] = 7;
  const auto file = run.folder / "other.bin";
  ASSERT_TRUE(write_file_atomic(file, bytes + content_hash(bytes)));
  const auto field = Field::load(file);
  ASSERT_FALSE(field);
  EXPECT_EQ(field.error().found, "an unknown modality");
}

TEST(FieldFile, WhatIsNoFieldOrCutIsToldApart) {
  Finished run;
  const std::string bytes = read_file(run.options.checkpoint).value();
  const auto file = run.folder / "other.bin";
  const auto found = [&](const std::string& content) {
    EXPECT_TRUE(write_file_atomic(file, content));
    const auto field = Field::load(file);
    return field ? std::string("a field") : field.error().found;
  };
  EXPECT_EQ(found(bytes), "a field");
  EXPECT_EQ(found(""), "cut short: 0 bytes");
  EXPECT_EQ(found(bytes.substr(0, bytes.size() / 2)), "checksum differs: cut or altered");
  std::string altered_bytes = bytes;
  altered_bytes[bytes.size() / 3] ^= 1;
  EXPECT_EQ(found(altered_bytes), "checksum differs: cut or altered");
  EXPECT_EQ(found("OFNERF03" + bytes.substr(8)), "a field of another version of this program");
  EXPECT_EQ(found(std::string(1000, 'x')), "not a field");
}

}  // namespace
}  // namespace orbitfuse::nerf
