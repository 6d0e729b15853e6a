// SPDX-License-Identifier: BSD-3-Clause
#include "app/pipeline/runner.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <set>

#include "app/pipeline/folder_lock.hpp"
#include "app/pipeline/stage_record.hpp"
#include "core/system/file_io.hpp"
#include "core/system/folder_change_lock.hpp"
#include "tests/support/refused_locks.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::pipeline {
namespace {
namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

/// A chain of stages a -> b -> c and a -> d that write text files and count their runs.
class RunnerTest : public testing::Test {
 protected:
  Stage text_stage(const std::string& name, std::vector<std::string> needs,
                   nlohmann::json options) {
    Stage stage{.name = name, .needs = needs, .options = options, .inputs_hash = session};
    stage.run = [this, name, needs, options](const StageContext& context) -> Result<StageOutput> {
      ++runs[name];
      if (fail_in.count(name)) return tl::unexpected(fail_in.at(name));
      std::string text = name + options.dump();
      for (const std::string& need : needs) text += *read_file(context.of(need) / "text");
      ORBITFUSE_TRY(write_file_atomic(context.folder / "text", text));
      StageOutput output;
      output.metrics["length"] = text.size();
      output.skips.push_back({"nothing", "test", "none"});
      return output;
    };
    return stage;
  }

  RunSummary run(RunOptions options = {}) {
    options.out = temp.path() / "out";
    runs.clear();
    Progress progress;
    progress.cancel = &cancel;
    Runner runner(
        {text_stage("a", {}, {{"x", a_option}}), text_stage("b", {"a"}, {{"y", b_option}}),
         text_stage("c", {"b"}, {}), text_stage("d", {"a"}, {})},
        options, progress);
    return runner.run();
  }

  /// In a dry run as in a real one, before the work, for what lies at `place`.
  void expect_refused(const fs::path& place) {
    RunOptions options;
    for (const bool dry : {true, false}) {
      options.dry_run = dry;
      const RunSummary refused = run(options);
      ASSERT_TRUE(refused.error);
      EXPECT_EQ(refused.error->kind, ErrorKind::usage);
      EXPECT_THAT(refused.error->message(), HasSubstr(place.string()));
      EXPECT_TRUE(runs.empty()) << "refused before the work";
    }
  }

  std::vector<std::string> ran() const {
    std::vector<std::string> names;
    for (const auto& [name, count] : runs) names.push_back(name);
    return names;
  }
  std::string text(const std::string& stage) {
    return *read_file(temp.path() / "out" / stage / "text");
  }

  test::TempFolder temp;
  std::string session = "session";
  int a_option = 1, b_option = 1;
  std::map<std::string, int> runs;
  std::map<std::string, Error> fail_in;
  std::atomic<bool> cancel{false};
};

TEST_F(RunnerTest, ResultsOfOtherInputsAreReplacedWhole) {
  ASSERT_FALSE(run().error);
  session = "another";
  RunOptions options;
  options.targets = {"b"};
  options.replace_all = options.dry_run = true;
  run(options);
  EXPECT_TRUE(fs::exists(temp.path() / "out" / "d")) << "a dry run";
  options.dry_run = false;
  EXPECT_FALSE(run(options).error);
  EXPECT_THAT(ran(), ElementsAre("a", "b"));
  EXPECT_FALSE(fs::exists(temp.path() / "out" / "c"));
  EXPECT_FALSE(fs::exists(temp.path() / "out" / "d")) << "of the other inputs";
}

TEST_F(RunnerTest, WhatTellsOfReplacedResultsGoesBeforeThem) {
  ASSERT_FALSE(run().error);
  const fs::path out = temp.path() / "out";
  for (const char* file : {"run.json", "mine.json"})
    ASSERT_TRUE(write_file_atomic(out / file, "{}"));
  session = "another";
  RunOptions options;
  options.replaced_files = {"run.json", "none.json"};
  EXPECT_FALSE(run(options).error);
  EXPECT_TRUE(fs::exists(out / "run.json")) << "nothing is replaced";
  options.replace_all = true;
  fail_in["a"] = {ErrorKind::device, "a", "stopped", ""};
  session = "a third";
  EXPECT_TRUE(run(options).error);
  EXPECT_FALSE(fs::exists(out / "run.json")) << "before the first stage has run";
  EXPECT_FALSE(fs::exists(out / "a"));
  EXPECT_TRUE(fs::exists(out / "mine.json"));
}

TEST_F(RunnerTest, SecondRunIsUnchanged) {
  ASSERT_FALSE(run().error);
  EXPECT_THAT(ran(), ElementsAre("a", "b", "c", "d"));
  const RunSummary again = run();
  EXPECT_TRUE(runs.empty());
  for (const StageStatus& s : again.stages) EXPECT_EQ(s.state, StageState::unchanged) << s.stage;
  EXPECT_EQ(again.find("c")->output.skips.at(0).what, "nothing");
  EXPECT_GT(again.find("c")->output.metrics.at("length"), 0);
}

TEST_F(RunnerTest, ChangedOptionRunsFromThere) {
  run();
  b_option = 2;
  const RunSummary summary = run();
  EXPECT_THAT(ran(), ElementsAre("b", "c"));
  EXPECT_EQ(summary.find("b")->why, "option y changed");
  EXPECT_EQ(summary.find("c")->why, "b changed");
}

TEST_F(RunnerTest, ChangedInputRunsAllThatReadsIt) {
  run();
  session = "other";
  EXPECT_EQ(run().find("a")->why, "the session changed");
  EXPECT_THAT(ran(), ElementsAre("a", "b", "c", "d"));
}

TEST_F(RunnerTest, SameOutputsCutTheChainShort) {
  run();
  RunOptions force;
  force.targets = {"a"};
  force.force = true;
  run(force);
  EXPECT_THAT(ran(), ElementsAre("a"));
  run();
  EXPECT_TRUE(runs.empty()) << "a wrote the same bytes, so nothing behind it changes";
}

TEST_F(RunnerTest, DamagedOutputRunsAgain) {
  run();
  std::ofstream(temp.path() / "out/b/text") << "tampered";
  EXPECT_EQ(run().find("b")->why, "text was changed");
  EXPECT_THAT(ran(), ElementsAre("b"));
  fs::remove(temp.path() / "out/c/text");
  EXPECT_EQ(run().find("c")->why, "text is missing");
}

/// --out may be any folder of the user's, and "report" a folder of theirs in it.
TEST_F(RunnerTest, WhatNoStageLeftIsNotReplaced) {
  const fs::path out = temp.path() / "out";
  ASSERT_TRUE(write_file_atomic(out / "c/thesis.txt", "mine"));
  expect_refused(out / "c");
  EXPECT_EQ(*read_file(out / "c/thesis.txt"), "mine");
  RunOptions options;
  options.targets = {"d"};
  EXPECT_FALSE(run(options).error) << "c is not written";
  EXPECT_EQ(*read_file(out / "c/thesis.txt"), "mine");
  fs::remove_all(out / "c");
  ASSERT_TRUE(write_file_atomic(out / "c", "mine"));
  EXPECT_TRUE(run().error) << "nor a file";
  EXPECT_EQ(*read_file(out / "c"), "mine");
  fs::remove(out / "c");
  fs::create_directory(out / "c");
  EXPECT_FALSE(run().error) << "an empty folder is nobody's loss";
}

/// Nor is a folder of theirs that is called as a failed stage's.
TEST_F(RunnerTest, WhatNoFailureLeftIsNotRemoved) {
  const fs::path out = temp.path() / "out";
  ASSERT_TRUE(write_file_atomic(out / "b.failed/notes.txt", "mine"));
  expect_refused(out / "b.failed");
  fail_in["b"] = {ErrorKind::quality, "b", "too few", "more"};
  run();
  EXPECT_EQ(*read_file(out / "b.failed/notes.txt"), "mine");
  RunOptions options;
  options.targets = {"d"};
  EXPECT_FALSE(run(options).error) << "b is not written";
  fs::remove_all(out / "b.failed");
  fs::create_directory(out / "b.failed");
  for (int i = 0; i < 2; ++i) EXPECT_EQ(run().error->kind, ErrorKind::quality);
  fail_in.clear();
  EXPECT_FALSE(run().error) << "what a failure left makes way";
  EXPECT_FALSE(fs::exists(out / "b.failed"));
}

TEST_F(RunnerTest, CutDoneMarkRunsAgain) {
  run();
  const fs::path mark = temp.path() / "out/d/stage.json";
  fs::resize_file(mark, fs::file_size(mark) / 2);
  run();
  EXPECT_THAT(ran(), ElementsAre("d"));
}

TEST_F(RunnerTest, EditedDoneMarkIsNamedAndRunsAgain) {
  run();
  const fs::path folder = temp.path() / "out/d", mark = folder / "stage.json";
  std::string text = *read_file(mark);
  const std::size_t at = text.find("\"wall_s\": ");
  ASSERT_NE(at, std::string::npos);
  text.insert(at + 10, "\"four\", \"was\": ");  // still JSON
  ASSERT_TRUE(write_file_atomic(mark, text));
  const auto record = read_stage_record(folder);
  ASSERT_FALSE(record);
  EXPECT_EQ(record.error().kind, ErrorKind::input);
  EXPECT_EQ(record.error().where, mark.string());
  run();
  EXPECT_THAT(ran(), ElementsAre("d"));
  EXPECT_TRUE(read_stage_record(folder));
}

TEST_F(RunnerTest, TargetsBringWhatTheyRead) {
  RunOptions options;
  options.targets = {"c"};
  run(options);
  EXPECT_THAT(ran(), ElementsAre("a", "b", "c"));
}

TEST_F(RunnerTest, FailedGateKeepsTheEarlierResultAndTheOtherBranch) {
  run();
  const std::string before = text("b");
  fail_in["b"] = {ErrorKind::quality, "b", "too few", "more"};
  a_option = 2;
  const RunSummary summary = run();
  EXPECT_EQ(text("b"), before);
  EXPECT_EQ(summary.error->kind, ErrorKind::quality);
  EXPECT_EQ(summary.find("c")->state, StageState::blocked);
  EXPECT_THAT(summary.find("c")->why, HasSubstr("b"));
  EXPECT_EQ(summary.find("d")->state, StageState::ran);
  EXPECT_TRUE(fs::exists(temp.path() / "out/b.failed"));
  fail_in.clear();
  EXPECT_FALSE(run().error);
  EXPECT_FALSE(fs::exists(temp.path() / "out/b.failed"));
}

TEST_F(RunnerTest, DeviceErrorStopsAtOnce) {
  fail_in["b"] = {ErrorKind::device, "b", "disk full", "free space"};
  const RunSummary summary = run();
  EXPECT_THAT(ran(), ElementsAre("a", "b"));
  EXPECT_EQ(summary.error->kind, ErrorKind::device);
}

TEST_F(RunnerTest, DryRunWritesNothing) {
  RunOptions options;
  options.dry_run = true;
  const RunSummary summary = run(options);
  EXPECT_TRUE(runs.empty());
  EXPECT_FALSE(fs::exists(temp.path() / "out"));
  for (const StageStatus& s : summary.stages) EXPECT_EQ(s.state, StageState::planned);
}

TEST_F(RunnerTest, CancelledBeforeAStageKeepsTheRest) {
  cancel = true;
  const RunSummary summary = run();
  EXPECT_EQ(summary.error->kind, ErrorKind::cancelled);
  EXPECT_EQ(summary.error->remedy, "run again with --resume");
  EXPECT_TRUE(runs.empty());
}

TEST(Runner, ResumesAnInterruptedStageWithTheSameKeyOnly) {
  const test::TempFolder temp;
  int option = 1;
  bool resumed = false;
  const auto run = [&](bool interrupt, bool resume) {
    Stage stage{.name = "long", .options = {{"x", option}}};
    stage.run = [&](const StageContext& context) -> Result<StageOutput> {
      resumed = context.resume;
      const bool half_done = fs::exists(context.folder / "half");
      EXPECT_EQ(half_done, context.resume);
      if (interrupt) {
        ORBITFUSE_TRY(write_file_atomic(context.folder / "half", "1"));
        return fail(ErrorKind::cancelled, "long", "stopped", "resume");
      }
      std::error_code ignored;
      fs::remove(context.folder / "half", ignored);
      ORBITFUSE_TRY(write_file_atomic(context.folder / "whole", "2"));
      return StageOutput{};
    };
    Runner runner({stage}, {.out = temp.path(), .resume = resume}, {});
    return runner.run();
  };
  EXPECT_EQ(run(true, false).error->kind, ErrorKind::cancelled);
  EXPECT_FALSE(fs::exists(temp.path() / "long"));
  EXPECT_FALSE(run(false, true).error);
  EXPECT_TRUE(resumed);
  EXPECT_EQ(run(false, true).stages.at(0).state, StageState::unchanged);

  option = 2;
  run(true, false);
  option = 3;
  run(false, true);
  EXPECT_FALSE(resumed) << "an attempt with other options must not be continued";
}

TEST(Runner, AStageSeesWhatOtherOptionsMadeOfTheSameInputs) {
  const test::TempFolder temp;
  int option = 1;
  std::string session = "one";
  std::optional<EarlierResult> seen;
  const auto run = [&](bool force = false) {
    Stage stage{.name = "long", .options = {{"x", option}}, .inputs_hash = session};
    stage.run = [&](const StageContext& context) -> Result<StageOutput> {
      seen = context.earlier_result();
      ORBITFUSE_TRY(write_file_atomic(context.folder / "result", std::to_string(option)));
      return StageOutput{.metrics = {{"made", option}}, .skips = {}, .warnings = {}};
    };
    Runner({stage}, {.out = temp.path(), .force = force}, {}).run();
  };
  run();
  EXPECT_FALSE(seen);
  option = 2;
  run();
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->folder, temp.path() / "long");
  EXPECT_EQ(seen->options.at("x"), 1);
  EXPECT_EQ(seen->metrics.at("made"), 1);
  option = 3;
  run(true);
  EXPECT_FALSE(seen) << "--force starts from nothing";
  option = 4;
  std::ofstream(temp.path() / "long/result") << "tampered";
  run();
  EXPECT_FALSE(seen) << "a damaged result is none";
  option = 5;
  session = "another";
  run();
  EXPECT_FALSE(seen) << "made from other inputs";
}

TEST(Runner, AbsentIsNotAFailure) {
  const test::TempFolder temp;
  Stage absent{.name = "thermal"};
  absent.absent = [](const StageContext&) {
    return std::optional<std::string>("no thermal frames");
  };
  absent.run = [](const StageContext&) -> Result<StageOutput> {
    ADD_FAILURE() << "must not run";
    return StageOutput{};
  };
  Stage behind{.name = "behind", .needs = {"thermal"}};
  behind.run = absent.run;
  Stage beside{.name = "beside", .uses = {"thermal"}};
  beside.run = [](const StageContext& c) -> Result<StageOutput> {
    EXPECT_FALSE(c.has("thermal"));
    return StageOutput{};
  };
  Runner runner({absent, behind, beside}, {.out = temp.path()}, {});
  const RunSummary summary = runner.run();
  EXPECT_FALSE(summary.error);
  EXPECT_EQ(summary.find("behind")->state, StageState::absent);
  EXPECT_EQ(summary.find("behind")->why, "no thermal frames");
  EXPECT_EQ(summary.find("beside")->state, StageState::ran);
}

TEST(Runner, WhatTheSessionRulesOutIsNotPlannedBehindStagesThatAre) {
  const test::TempFolder temp;
  Stage before{.name = "visible"};
  Stage pointless{.name = "thermal", .uses = {"visible"}, .pointless = "no thermal frames"};
  Stage behind{.name = "behind", .needs = {"thermal"}};
  for (Stage* stage : {&before, &pointless, &behind})
    stage->run = [](const StageContext&) -> Result<StageOutput> { return StageOutput{}; };
  Runner runner({before, pointless, behind}, {.out = temp.path(), .dry_run = true}, {});
  const RunSummary summary = runner.run();
  EXPECT_EQ(summary.find("visible")->state, StageState::planned);
  EXPECT_EQ(summary.find("thermal")->state, StageState::absent);
  EXPECT_EQ(summary.find("thermal")->why, "no thermal frames");
  EXPECT_EQ(summary.find("behind")->state, StageState::absent);
}

TEST_F(RunnerTest, WhatWasMadeOfEarlierResultsIsNamed) {
  ASSERT_FALSE(run().error);
  const fs::path out = temp.path() / "out";
  const std::set<std::string> all = {"a", "b", "c", "d"};
  EXPECT_THAT(out_of_date(out, all), ElementsAre());
  a_option = 17;
  RunOptions only_a;
  only_a.targets = {"a"};
  ASSERT_FALSE(run(only_a).error);
  EXPECT_THAT(out_of_date(out, all),
              ElementsAre("b was made of an earlier a", "d was made of an earlier a"));
  EXPECT_THAT(out_of_date(out, {"c"}), ElementsAre());
  ASSERT_FALSE(run().error);
  EXPECT_THAT(out_of_date(out, all), ElementsAre());
  EXPECT_THAT(out_of_date(temp.path() / "none", all), ElementsAre());
}

TEST_F(RunnerTest, WhatIsTakenAsItLiesIsLeftOutWhereItWasMadeOfAnEarlierStage) {
  run();
  RunOptions only_c;
  only_c.targets = {"c"};
  only_c.targets_only = true;
  EXPECT_EQ(run(only_c).find("b")->state, StageState::unchanged);
  a_option = 2;
  RunOptions only_a;
  only_a.targets = {"a"};
  run(only_a);
  const RunSummary summary = run(only_c);
  EXPECT_EQ(summary.find("a")->state, StageState::unchanged);
  EXPECT_EQ(summary.find("b")->state, StageState::absent);
  EXPECT_THAT(summary.find("b")->why, HasSubstr("made of an earlier a"));
  EXPECT_THAT(summary.find("b")->output.warnings,
              ElementsAre(HasSubstr("left out, for it was made of an earlier a")));
  EXPECT_TRUE(runs.empty()) << "c reads b";
}

TEST_F(RunnerTest, AFileInAStageIsToldFromOneBesideIt) {
  ASSERT_FALSE(run().error);
  const fs::path out = temp.path() / "out";
  EXPECT_TRUE(lies_in_a_stage(out, out / "a/new.ply"));
  EXPECT_TRUE(lies_in_a_stage(out, out / "export/../b/deep/new.ply"));
  EXPECT_TRUE(lies_in_a_stage(out, out / "c"));
  EXPECT_FALSE(lies_in_a_stage(out, out / "export/new.ply"));
  EXPECT_FALSE(lies_in_a_stage(out, out));
  EXPECT_FALSE(lies_in_a_stage(out, temp.path() / "a/new.ply"));
}

/// As where the right to look into it is missing: a run without that stage would be a guess.
TEST(Runner, AStageThatMayNotBeLookedIntoIsNoMissingOne) {
  const test::TempFolder temp;
  fs::create_symlink("depth", temp / "depth");
  fs::create_directory(temp / "render");
  for (const char* of_the_user : {"lost+found", "backup"})
    fs::create_symlink(of_the_user, temp / of_the_user);
  EXPECT_THAT(finished_stages(temp.path(), {"depth", "render"}), ElementsAre("depth"));
  EXPECT_THAT(read_stage_record(temp / "depth").error().message(), HasSubstr("symbolic links"));
  Runner runner({Stage{.name = "depth"}}, {.out = temp.path()}, {});
  const RunSummary summary = runner.run();
  ASSERT_TRUE(summary.error);
  EXPECT_EQ(summary.error->kind, ErrorKind::device);
  EXPECT_THAT(summary.error->message(), HasSubstr("symbolic links"));
}

TEST(Runner, ADiskWithoutLocksIsNoOtherRun) {
  const test::TempFolder temp;
  const test::NoLocks no_locks;
  FolderLock lock;
  const Status status = lock.acquire(temp / ".lock");
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().kind, ErrorKind::device);
  EXPECT_EQ(status.error().found, "cannot be locked: No locks available");
  FolderChangeLock change;
  EXPECT_EQ(change.acquire(temp.path()).error().found, "cannot be locked: No locks available");
}

TEST(Runner, TwoRunsInOneFolderAreRefused) {
  const test::TempFolder temp;
  Stage outer{.name = "outer"};
  outer.run = [&](const StageContext&) -> Result<StageOutput> {
    Runner inner({}, {.out = temp.path()}, {});
    const RunSummary summary = inner.run();
    EXPECT_TRUE(summary.error && summary.error->kind == ErrorKind::usage);
    return StageOutput{};
  };
  Runner runner({outer}, {.out = temp.path()}, {});
  EXPECT_FALSE(runner.run().error);
}

}  // namespace
}  // namespace orbitfuse::pipeline
