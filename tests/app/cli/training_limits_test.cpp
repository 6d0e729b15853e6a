// SPDX-License-Identifier: BSD-3-Clause
#include "app/cli/training_limits.hpp"

#include <gtest/gtest.h>

namespace orbitfuse::cli {
namespace {

TEST(Duration, IsReadInSeconds) {
  const std::pair<const char*, double> cases[] = {{"60s", 60},  {"2m", 120},     {"1.5m", 90},
                                                  {"90", 90},   {"1h", 3600},    {"1m30s", 90},
                                                  {"0.5", 0.5}, {"1h1m1s", 3661}};
  for (const auto& [text, seconds] : cases) {
    const auto read = parse_duration(text);
    ASSERT_TRUE(read) << text;
    EXPECT_EQ(*read, seconds) << text;
  }
  for (const char* text : {"", "0", "-3s", "2 m", "5x", "s", "1m1m", "1s1m", "nan", "inf", "1e400",
                           "60 s", "1h30", "1m30"}) {
    const auto read = parse_duration(text);
    ASSERT_FALSE(read) << text;
    EXPECT_EQ(read.error().kind, ErrorKind::usage);
    EXPECT_NE(read.error().message().find("1m30s"), std::string::npos) << "an example to copy";
  }
}

TEST(TrainingLimits, GoToTheFieldsNamedOnly) {
  stages::RunConfig config;
  const stages::RunConfig before;
  ASSERT_TRUE(apply({}, {Modality::visible, Modality::thermal}, config));
  EXPECT_EQ(config.settings().to_json(), stages::RunConfig(before).settings().to_json())
      << "none given, none set";
  ASSERT_TRUE(apply({"2m", 27}, {Modality::thermal}, config));
  EXPECT_EQ(config.train_thermal.options.budget_s, 120);
  EXPECT_EQ(config.train_thermal.options.target_psnr, 27);
  EXPECT_GT(config.train_thermal.options.iterations, 1000000)
      << "the time ends the run, not the steps";
  EXPECT_GE(config.train_thermal.options.eval_count, 24);
  EXPECT_EQ(config.train_visible.options.budget_s, 0);
  EXPECT_EQ(config.train_visible.options.target_psnr, 0);

  config.train_visible.options.holdout_every = 0;
  const Status unmeasured = apply({std::nullopt, 27}, {Modality::visible}, config);
  ASSERT_FALSE(unmeasured);
  EXPECT_EQ(unmeasured.error().where, "train.visible.target_psnr");
  EXPECT_NE(unmeasured.error().remedy.find("train.visible.holdout_every"), std::string::npos);
}

}  // namespace
}  // namespace orbitfuse::cli
