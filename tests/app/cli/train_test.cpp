// SPDX-License-Identifier: BSD-3-Clause
// Training by time, to a target, further, and from damaged files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/system/file_io.hpp"
#include "tests/app/cli/program.hpp"
#include "tests/app/cli/session_fixture.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

class Train : public testing::Test {
 protected:
  Train() { write_fixture_session(session, {.visible = 8, .thermal = 0}); }
  Outcome run(std::vector<std::string> more, const std::string& verb = "train",
              const RunOptions& options = {}) {
    std::vector<std::string> words = {verb,         session.string(), "--out",
                                      out.string(), "--json",         "--verbose"};
    for (const char* set : {"train.visible.eval_count=2", "train.visible.cloud_width_px=32",
                            "train.visible.log2_table=12", "train.visible.samples_per_step=2048",
                            "depth.width_px=64"})
      words.insert(words.end(), {"--set", set});
    words.insert(words.end(), more.begin(), more.end());
    return orbitfuse_program(words, options);
  }
  static std::vector<std::string> steps(int iterations) {
    return {"--modality", "visible", "--set",
            "train.visible.iterations=" + std::to_string(iterations)};
  }
  json stage() const { return json::parse(*read_file(out / "train_visible/stage.json")); }
  json curve() const { return json::parse(*read_file(out / "train_visible/curve.json")); }
  std::string field() const { return *file_hash(out / "train_visible/field.bin"); }
  bool extended() const {
    return stage().at("skips").dump().find("training goes on from there") != std::string::npos;
  }

  test::TempFolder temp;
  fs::path session = temp.path() / "session", out = temp.path() / "out";
};

TEST_F(Train, MoreStepsGoOnFromTheResultAndForceDoesNot) {
  ASSERT_EQ(run(steps(60)).code, 0);
  const json first = curve();
  EXPECT_FALSE(extended());
  EXPECT_FALSE(fs::exists(out / "train_visible/checkpoint.bin")) << "no disk space is kept for it";
  const Outcome more = run(steps(120));
  ASSERT_EQ(more.code, 0) << more.err;
  EXPECT_TRUE(extended());
  EXPECT_THAT(more.err, HasSubstr("the first 60 steps"));
  EXPECT_EQ(stage().at("metrics").at("iterations"), 120);
  ASSERT_EQ(curve().size(), 3u);  // two a run: 30, 60 and 120
  EXPECT_EQ(curve()[1], first[1]);
  EXPECT_GE(stage().at("metrics").at("heldout_psnr_db").get<double>(),
            first[1].at("heldout_psnr").get<double>());
  const std::string longer = field();

  auto forced = steps(120);
  forced.push_back("--force");
  ASSERT_EQ(run(forced).code, 0);
  EXPECT_FALSE(extended());
  EXPECT_EQ(curve().size(), 2u);
  EXPECT_NE(field(), longer);
  // Fewer steps, and other data or losses, are another training.
  ASSERT_EQ(run(steps(60)).code, 0);
  EXPECT_FALSE(extended());
  auto other = steps(120);
  other.insert(other.end(), {"--set", "train.visible.distortion_weight=0.1"});
  ASSERT_EQ(run(other).code, 0);
  EXPECT_FALSE(extended());
}

TEST_F(Train, ABudgetEndsTheTrainingAndALargerOneGoesOn) {
  const auto within = [this](double budget_s) {
    return run({"--modality", "visible", "--budget", std::to_string(budget_s)});
  };
  double budget_s = 1.5;
  Outcome outcome = within(budget_s);
  // How long the first step takes to come is the machine's, and a shorter budget is refused.
  for (; outcome.code != 0 && budget_s < 60; outcome = within(budget_s)) {
    ASSERT_THAT(outcome.err, HasSubstr("were over before the first step"));
    budget_s *= 2;
  }
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json short_run = stage().at("metrics");
  EXPECT_EQ(short_run.at("stop"), "budget");
  const double spent_s = short_run.at("train_wall_s"), more_s = spent_s + budget_s;
  EXPECT_GE(spent_s, budget_s);
  ASSERT_EQ(within(more_s).code, 0);
  EXPECT_TRUE(extended());
  EXPECT_GE(stage().at("metrics").at("train_wall_s"), more_s - 1e-3);
  EXPECT_GT(stage().at("metrics").at("iterations"), short_run.at("iterations"));
}

TEST_F(Train, ProgressTellsWhatIsLeftAndTheHeldOutError) {
  const Outcome outcome = run(steps(200));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  bool told = false;
  for (const json& event : outcome.events())
    if (event.at("event") == "progress" && event.at("stage") == "train.visible" &&
        event.contains("detail"))
      told = told || (event.at("eta_s").is_number() &&
                      event.at("detail").get<std::string>().find("held-out ") != std::string::npos);
  EXPECT_TRUE(told);
}

TEST_F(Train, ATargetStopsOrWarnsAndNeedsHeldOutViews) {
  auto low = steps(400);
  low.insert(low.end(), {"--target-psnr", "8"});
  ASSERT_EQ(run(low).code, 0);
  EXPECT_EQ(stage().at("metrics").at("stop"), "target PSNR");
  EXPECT_LT(stage().at("metrics").at("iterations"), 400);
  auto high = steps(60);
  high.insert(high.end(), {"--target-psnr", "60"});
  const Outcome missed = run(high);
  ASSERT_EQ(missed.code, 0);
  EXPECT_THAT(missed.err, HasSubstr("the target of 60.00 dB was not reached"));
  for (const char* verb : {"train", "run"}) {
    const Outcome refused =
        run({"--target-psnr", "20", "--set", "train.visible.holdout_every=0"}, verb);
    EXPECT_EQ(refused.code, 2);
    EXPECT_THAT(refused.err, HasSubstr("--set train.visible.holdout_every=12"));
    EXPECT_EQ(run({"--budget", "soon"}, verb).code, 2) << verb;
    EXPECT_EQ(run({"--budget", "0.0001s", "--modality", "visible"}).code, 2)
        << "no step fits in it";
    EXPECT_EQ(run({"--target-psnr", "0"}, verb).code, 2);
  }
}

TEST_F(Train, ACutCheckpointIsNamedAndTheNextRunStartsAnew) {
  auto words = steps(3000);
  const Outcome stopped = run(words, "train", {.interrupt_after = "training views"});
  if (stopped.code == 0) GTEST_SKIP() << "the training was over before the signal arrived";
  ASSERT_EQ(stopped.code, 130) << stopped.err;
  const fs::path checkpoint = out / ".partial/train_visible/checkpoint.bin";
  ASSERT_TRUE(fs::exists(checkpoint));
  fs::resize_file(checkpoint, fs::file_size(checkpoint) / 2);
  words.push_back("--resume");
  const Outcome cut = run(words);
  EXPECT_EQ(cut.code, 3) << cut.err;
  EXPECT_THAT(cut.err, HasSubstr("checkpoint.bin: checksum differs: cut or altered"));
  words[3] = "train.visible.iterations=20";
  EXPECT_EQ(run(words).code, 0);
}

TEST_F(Train, ACutFieldIsMadeAgainAndOneThatItsRecordDoesNotTellIsNamed) {
  ASSERT_EQ(run(steps(20)).code, 0);
  const std::string whole = field();
  const fs::path file = out / "train_visible/field.bin";
  fs::resize_file(file, fs::file_size(file) / 2);
  const Outcome repaired = run(steps(20));
  EXPECT_EQ(repaired.code, 0);
  EXPECT_THAT(repaired.err, HasSubstr("field.bin was changed"));
  EXPECT_EQ(field(), whole);

  fs::resize_file(file, fs::file_size(file) / 2);
  json record = stage();
  for (json& output : record.at("outputs"))
    if (output.at("file") == "field.bin") {
      output["bytes"] = fs::file_size(file);
      output["hash"] = field();
    }
  record.erase("check");
  record["check"] = content_hash(record.dump());
  ASSERT_TRUE(write_file_atomic(out / "train_visible/stage.json", record.dump()));
  const Outcome render = run({"--set", "train.visible.iterations=20"}, "render");
  EXPECT_EQ(render.code, 3) << render.err;
  EXPECT_THAT(render.err, HasSubstr("field.bin: checksum differs: cut or altered"));
}

}  // namespace
}  // namespace orbitfuse
