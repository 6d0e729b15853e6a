// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <map>
#include <thread>

#include "app/farm/farm_lock.hpp"
#include "app/farm/folder_probe.hpp"
#include "app/farm/local_farm.hpp"
#include "app/farm/overview.hpp"
#include "app/farm/slurm.hpp"
#include "app/farm/slurm_farm.hpp"
#include "app/farm/stage_job.hpp"
#include "app/stages/build_stages.hpp"
#include "app/terminal/interrupt.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::farm {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

/// A farm whose program is a script: $2 is the session's folder, $6 the stage.
class FarmTest : public ::testing::Test {
 protected:
  void program(const std::string& body) {
    test::put_program(temp / "program", "#!/bin/sh\nsession=$(basename $2)\nstage=$6\n" + body);
    plan.program = (temp / "program").string();
    plan.stages = {"first", "second"};
    for (const char* name : {"a", "b", "c"}) {
      fs::create_directories(temp / name);
      plan.sessions.push_back({name, (temp / name).string()});
    }
    fs::create_directories(out);
  }
  Status run(LocalLimits limits = {}) {
    return run_local(
        out, plan, limits, [](const auto&, const auto&, const auto&) {}, Progress{});
  }
  JobOutcome outcome(const std::string& session, const std::string& stage) const {
    return read_outcome(out, session, stage);
  }

  test::TempFolder temp;
  fs::path out = temp / "farm";
  FarmPlan plan;
};

TEST_F(FarmTest, OneSessionsFailureIsNamedAndStopsNoOther) {
  program(
      "[ $session = b ] || exit 0\n"
      "echo '{\"event\":\"result\",\"error\":{\"message\":\"visible/003.png: cut off\"}}'\n"
      "exit 3\n");
  ASSERT_TRUE(run());
  for (const char* session : {"a", "c"})
    for (const char* stage : {"first", "second"}) {
      EXPECT_EQ(outcome(session, stage).state, JobState::done);
      EXPECT_EQ(outcome(session, stage).starts, 1);
    }
  EXPECT_EQ(outcome("b", "first").state, JobState::failed);
  EXPECT_EQ(outcome("b", "first").exit_code, 3);
  EXPECT_EQ(outcome("b", "first").cause, "visible/003.png: cut off");
  EXPECT_EQ(outcome("b", "second").state, JobState::waiting);

  const auto rows = look_at_sessions(out, plan);
  EXPECT_THAT(to_csv(rows), HasSubstr("b,failed,first,visible/003.png: cut off,0,1,"));
  EXPECT_THAT(to_html(rows, plan), HasSubstr("2 done, 1 failed"));
}

TEST_F(FarmTest, AKilledStageIsTriedAgainBoundedAndAFinishedOneNever) {
  program(
      "echo x >> $4.$stage.starts\n"
      "[ $session$stage = asecond ] && [ ! -e $4.killed ] && touch $4.killed && kill -9 $$\n"
      "[ $session = c ] && kill -9 $$\n"
      "exit 0\n");
  ASSERT_TRUE(run());
  EXPECT_EQ(outcome("a", "first").starts, 1);
  EXPECT_EQ(outcome("a", "second").starts, 2);
  EXPECT_EQ(outcome("a", "second").state, JobState::done);
  EXPECT_EQ(outcome("c", "first").starts, plan.tries);
  EXPECT_EQ(outcome("c", "first").state, JobState::interrupted);
  EXPECT_THAT(outcome("c", "first").cause, HasSubstr("out of memory"));

  ASSERT_TRUE(run());
  EXPECT_EQ(outcome("a", "first").starts, 1);
  EXPECT_EQ(outcome("b", "second").starts, 1);
}

TEST_F(FarmTest, StagesAtATimeAreBoundedByCoresAndMemory) {
  // Each says when it begins and ends; the largest number between is what ran at a time.
  program("echo + >> " + (temp / "log").string() + "; sleep 0.2; echo - >> " +
          (temp / "log").string() + "\n");
  const auto most = [&] {
    std::ifstream log(temp / "log");
    int now = 0, largest = 0;
    for (std::string line; std::getline(log, line);)
      largest = std::max(largest, now += line == "+" ? 1 : -1);
    fs::remove(temp / "log");
    fs::remove_all(out);
    return largest;
  };
  for (const std::string& stage : plan.stages) plan.needs[stage] = {1, 1000, 60, false};
  ASSERT_TRUE(run({.workers = 0, .cores = 2, .memory_mb = 9000}));
  EXPECT_EQ(most(), 2);
  ASSERT_TRUE(run({.workers = 0, .cores = 8, .memory_mb = 1500}));
  EXPECT_EQ(most(), 1);
  ASSERT_TRUE(run({.workers = 1, .cores = 8, .memory_mb = 9000}));
  EXPECT_EQ(most(), 1);
}

TEST_F(FarmTest, OneStageAtATimeTakesTheGpuUnlessMoreAreAllowedOthersRunBeside) {
  // A line when each begins and ends: "stage +", "stage -".
  const fs::path log = temp / "log";
  program("echo $stage + >> " + log.string() + "; sleep 0.2; echo $stage - >> " + log.string() +
          "\n");
  for (const std::string& stage : plan.stages) plan.needs[stage] = {1, 100, 60, false};
  plan.needs["second"].gpu = true;
  std::map<std::string, int> most;
  const auto count = [&](int gpu_jobs) {
    most.clear();
    fs::remove(log);
    fs::remove_all(out);
    ASSERT_TRUE(run({.workers = 3, .cores = 8, .memory_mb = 9000, .gpu_jobs = gpu_jobs}));
    std::map<std::string, int> now;
    std::ifstream lines(log);
    for (std::string stage, sign; lines >> stage >> sign;)
      most[stage] = std::max(most[stage], now[stage] += sign == "+" ? 1 : -1);
  };
  count(1);
  EXPECT_GE(most["first"], 1);
  EXPECT_EQ(most["second"], 1);
  count(2);
  EXPECT_GE(most["second"], 1);
  EXPECT_LE(most["second"], 2);
  EXPECT_THAT(LocalLimits{.gpu_jobs = 0}.validate().error().message(), HasSubstr("--gpu-jobs"));
}

TEST_F(FarmTest, RecordsThatCantBeWrittenStopTheFarmAndAreNamed) {
  program("exit 0\n");
  test::put(out / ".farm/b", "no folder");
  const Status stopped = run();
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().kind, ErrorKind::device);
  EXPECT_THAT(stopped.error().message(), HasSubstr(".farm/b"));
  fs::remove(out / ".farm/b");
  ASSERT_TRUE(run());
  EXPECT_EQ(outcome("b", "second").state, JobState::done);
}

TEST_F(FarmTest, WhatWasKilledOrLateGetsMoreOnce) {
  program("");
  plan.needs["first"] = {1, 1000, 10, false};
  JobOutcome killed;
  killed.state = JobState::interrupted;
  killed.exit_code = exit_killed;
  killed.memory_mb = 990;
  ASSERT_TRUE(write_outcome(out, "a", "first", killed));
  JobOutcome late = killed;
  late.exit_code = 130;
  late.cause = std::string(out_of_time) + " (Slurm's limit)";
  late.wall_s = 540;
  ASSERT_TRUE(write_outcome(out, "b", "first", late));
  for (int i = 0; i < 2; ++i) {
    raise_interrupted(out, plan);
    EXPECT_EQ(plan.needs_of("first").memory_mb, 1980);
    EXPECT_EQ(plan.needs_of("first").time_min, 18);
    EXPECT_EQ(plan.needs_of("second"), StageNeeds{});
  }
}

TEST_F(FarmTest, WhatWasLearnedTakesNothingFromAnEdit) {
  program("");
  plan.needs["first"] = {.cores = 1, .memory_mb = 9000, .time_min = 300, .gpu = false};
  plan.needs["second"] = {.cores = 1, .memory_mb = 100, .time_min = 1, .gpu = false};
  JobOutcome done;
  done.state = JobState::done;
  done.memory_mb = 2000;
  done.wall_s = 600;
  for (const char* stage : {"first", "second"}) ASSERT_TRUE(write_outcome(out, "a", stage, done));
  raise_learned(out, plan);
  EXPECT_EQ(plan.needs_of("first").memory_mb, 9000);
  EXPECT_EQ(plan.needs_of("first").time_min, 300);
  EXPECT_EQ(plan.needs_of("first").usual_s, 600);
  EXPECT_EQ(plan.needs_of("second").memory_mb, 3000);
  EXPECT_EQ(plan.needs_of("second").time_min, 40);
}

TEST(Needs, TrainingAndRenderingAskForAGpuWhereTheRunUsesOne) {
  const std::vector<std::string> stages = {"depth",  "train_visible", "poses_thermal",
                                           "render", "metrics",       "report"};
  for (const bool on_gpu : {false, true}) {
    const auto needs = default_needs(stages, 2, on_gpu);
    EXPECT_EQ(needs.at("train_visible").gpu, on_gpu);
    EXPECT_EQ(needs.at("render").gpu, on_gpu);
    EXPECT_EQ(needs.at("poses_thermal").gpu, on_gpu);
    EXPECT_EQ(needs.at("metrics").gpu, on_gpu);
    EXPECT_FALSE(needs.at("depth").gpu);
    EXPECT_FALSE(needs.at("report").gpu);
  }
}

TEST_F(FarmTest, AProgramThatIsNotThereIsSaid) {
  program("");
  plan.program = (temp / "nowhere").string();
  ASSERT_TRUE(run());
  EXPECT_EQ(outcome("a", "first").state, JobState::failed);
  EXPECT_THAT(outcome("a", "first").cause, HasSubstr("program is not there"));
}

TEST_F(FarmTest, ThePlanComesBackAsItWasWrittenAndABrokenOneIsRefused) {
  program("");
  plan.options = {"--set", "render.views=2"};
  plan.needs["first"] = {4, 8000, 30, true, 12.5};
  plan.on_slurm = true;
  plan.slurm.partition = "long";
  plan.rounds = {{1000, {"12", "13"}, {{"first", "second"}}}};
  plan.slurm.least_job_s = 7;
  ASSERT_TRUE(write_plan(out, plan));
  const auto read = read_plan(out);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->options, plan.options);
  EXPECT_EQ(read->needs, plan.needs);
  EXPECT_EQ(read->slurm.partition, "long");
  EXPECT_EQ(read->rounds.at(0).jobs, plan.rounds.at(0).jobs);
  EXPECT_EQ(read->rounds.at(0).stages, plan.rounds.at(0).stages);
  EXPECT_EQ(read->slurm.least_job_s, 7);
  for (const char* text : {"", "[]", "{\"schema\":1", "{\"schema\":1}", "{\"schema\":9}"}) {
    test::put(out / plan_file, text);
    const auto broken = read_plan(out);
    ASSERT_FALSE(broken) << text;
    EXPECT_EQ(broken.error().kind, ErrorKind::input);
    EXPECT_THAT(broken.error().where, HasSubstr("farm.json"));
  }
}

TEST_F(FarmTest, TwoSessionsOfOneNameAreRefused) {
  fs::create_directories(temp / "x/car");
  fs::create_directories(temp / "y/car");
  const auto named = name_sessions({(temp / "x/car").string(), (temp / "y/car").string()});
  ASSERT_FALSE(named);
  EXPECT_EQ(named.error().kind, ErrorKind::usage);
  EXPECT_THAT(named.error().found, HasSubstr("called 'car' like"));
  EXPECT_FALSE(name_sessions({(temp / "nothing").string()}));
  EXPECT_FALSE(name_sessions({}));
}

TEST_F(FarmTest, ALiveHolderIsNamedADeadOneIsReplacedAnotherHostsNever) {
  fs::create_directories(out);
  {
    FarmLock first, second;
    ASSERT_TRUE(first.acquire(out));
    const Status refused = second.acquire(out);
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().found, HasSubstr(std::to_string(getpid())));
    EXPECT_THAT(refused.error().found, HasSubstr(host_name()));
  }
  EXPECT_FALSE(fs::exists(out / "farm.lock"));
  const auto held_by = [&](const std::string& host) {
    test::put(out / "farm.lock",
              "{\"host\":\"" + host + "\",\"boot\":\"earlier\",\"pid\":1,\"start\":\"1\"}");
  };
  held_by(host_name());
  EXPECT_TRUE(FarmLock().acquire(out));
  held_by("elsewhere");
  const Status refused = FarmLock().acquire(out);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().found, HasSubstr("elsewhere"));
  EXPECT_TRUE(fs::exists(out / "farm.lock"));
}

/// Variables of Slurm's for the time of a test.
struct Variables {
  explicit Variables(std::map<std::string, std::string> values) {
    for (const auto& [name, value] : values) {
      const char* old = getenv(name.c_str());
      before[name] = old == nullptr ? "" : old;
      setenv(name.c_str(), value.c_str(), 1);
    }
  }
  ~Variables() {
    for (const auto& [name, value] : before)
      value.empty() ? unsetenv(name.c_str()) : setenv(name.c_str(), value.c_str(), 1);
  }
  std::map<std::string, std::string> before;
};

TEST_F(FarmTest, ASlurmJobThatIsStartedAgainElsewhereTakesItsOwnLock) {
  fs::create_directories(out);
  const auto held_by_job = [&](const std::string& job, const std::string& restarts) {
    test::put(out / "farm.lock",
              "{\"host\":\"elsewhere\",\"boot\":\"x\",\"pid\":1,\"start\":\"1\",\"job\":\"" + job +
                  "\",\"restarts\":\"" + restarts + "\"}");
  };
  const Variables slurm({{"SLURM_JOB_ID", "17"}, {"SLURM_RESTART_COUNT", "1"}});
  held_by_job("17", "");
  EXPECT_TRUE(FarmLock().acquire(out));
  held_by_job("17", "1");  // the same start: a second node of one job
  EXPECT_FALSE(FarmLock().acquire(out));
  held_by_job("18", "");
  EXPECT_FALSE(FarmLock().acquire(out));
}

TEST_F(FarmTest, ATaskThatSlurmStartedTooOftenIsGivenUpAndAResumeTriesAnew) {
  program("exit 0\n");
  JobOutcome lost;
  lost.state = JobState::running;
  lost.starts = plan.tries;
  lost.host = "n7";
  ASSERT_TRUE(write_outcome(out, "a", "first", lost));
  {
    const Variables slurm({{"SLURM_RESTART_COUNT", std::to_string(plan.tries)}});
    EXPECT_FALSE(run_task(out, plan, {"first", "second"}, 0, Progress{}));
    EXPECT_EQ(outcome("a", "first").state, JobState::failed);
    EXPECT_EQ(outcome("a", "first").cause, "interrupted 3 times; last on n7");
    EXPECT_EQ(outcome("a", "second").starts, 0);
  }
  EXPECT_TRUE(run_task(out, plan, {"first", "second"}, 0, Progress{}));
  EXPECT_EQ(outcome("a", "first").state, JobState::done);
  EXPECT_EQ(outcome("a", "second").starts, 1);
}

TEST_F(FarmTest, ATaskGoesOnWithItsChainAndNotBeyondAFailure) {
  program("[ $session$stage = bsecond ] && exit 3\nexit 0\n");
  plan.stages = {"first", "second", "third"};
  EXPECT_TRUE(run_task(out, plan, plan.stages, 0, Progress{}));
  EXPECT_FALSE(run_task(out, plan, plan.stages, 1, Progress{}));
  EXPECT_EQ(outcome("a", "third").state, JobState::done);
  EXPECT_EQ(outcome("b", "first").state, JobState::done);
  EXPECT_EQ(outcome("b", "second").state, JobState::failed);
  EXPECT_EQ(outcome("b", "third").state, JobState::waiting);
  // Started again: what is done stays, the rest goes on.
  program("exit 0\n");
  EXPECT_TRUE(run_task(out, plan, {"first", "second", "third"}, 1, Progress{}));
  EXPECT_EQ(outcome("b", "first").starts, 1);
  EXPECT_EQ(outcome("b", "second").starts, 2);
}

TEST_F(FarmTest, OfAChainThatSlurmEndedOnlyWhatWasCutOffGetsMore) {
  program("");
  fs::create_directories(out);
  plan.rounds = {{0, {"12", "13"}, {{"first", "second"}}}};
  plan.needs["first"] = plan.needs["second"] = {1, 1000, 10, false, 5};
  for (const char* session : {"a", "b", "c"}) {
    JobOutcome done;
    done.state = JobState::done;
    ASSERT_TRUE(write_outcome(out, session, "first", done));
  }
  JobOutcome running;  // killed with all that would have recorded it
  running.state = JobState::running;
  ASSERT_TRUE(write_outcome(out, "b", "second", running));
  test::put_program(temp / "bin/sacct", "#!/bin/sh\necho COMPLETED; echo TIMEOUT\n");
  const Variables slurm({{"PATH", (temp / "bin").string() + ":" + std::string(getenv("PATH"))}});
  raise_needs(out, plan, Progress{});
  EXPECT_EQ(plan.needs_of("first").time_min, 10);
  EXPECT_EQ(plan.needs_of("second").time_min, 20);
  EXPECT_EQ(plan.needs_of("second").memory_mb, 1000);
}

TEST_F(FarmTest, JobsOfAnotherUserAndOfADeadSubmissionAreQueuedOnes) {
  fs::create_directories(out);
  plan.rounds = {{0, {"12", "13"}, {}}};
  test::put_program(temp / "bin/squeue", "#!/bin/sh\necho '12 /elsewhere\n13 /elsewhere\n14 " +
                                             out.string() + "\n15 " + out.string() + "/x'\n");
  const Variables slurm({{"SLURM_JOB_ID", "13"},
                         {"PATH", (temp / "bin").string() + ":" + std::string(getenv("PATH"))}});
  const auto queued = queued_jobs(out, plan, Progress{});
  ASSERT_TRUE(queued) << queued.error().message();
  EXPECT_THAT(*queued, ::testing::ElementsAre("12", "14"));
}

TEST(Interrupt, OneWishThatComesTwiceIsOne) {
  EXPECT_EXIT(
      {
        terminal::install_interrupt_handler();
        raise(SIGTERM);
        raise(SIGTERM);
        _exit(terminal::interrupt_flag().load() ? 42 : 1);
      },
      ::testing::ExitedWithCode(42), "stopping");
}

TEST(FolderProbe, ADeadFileSystemIsNamedAndWaitedForBounded) {
  const Status dead = answers("/mnt/dead", 0.1, [] { pause(); });
  ASSERT_FALSE(dead);
  EXPECT_EQ(dead.error().kind, ErrorKind::device);
  EXPECT_THAT(dead.error().message(), HasSubstr("/mnt/dead"));
  EXPECT_TRUE(answers("/tmp"));
  EXPECT_TRUE(answers("/no/such/folder"));
}

TEST(Slurm, WordsOfAnArray) {
  EXPECT_EQ(index_list({0, 1, 2, 5, 7, 8}), "0-2,5,7-8");
  EXPECT_EQ(shell_word("it's"), "'it'\\''s'");
  FarmPlan plan;
  const StageChain chain{{"train", "render"}, {4, 3000, 30, true, 90}};
  plan.slurm = {"cpu", "gpu", ""};
  const auto words = array_words(plan, "/farm", chain, "0-2", "17");
  for (const char* word :
       {"--cpus-per-task=4", "--mem=3000M", "--time=30", "--array=0-2", "--partition=gpu",
        "--dependency=aftercorr:17", "--kill-on-invalid-dep=yes", "--requeue"})
    EXPECT_THAT(words, ::testing::Contains(word));
  plan.slurm.gpu_partition.clear();
  EXPECT_THAT(array_words(plan, "/farm", chain, "0", ""), ::testing::Contains("--partition=cpu"));
}

TEST(StageChains, GoOnUntilTheyAreLongEnough) {
  FarmPlan plan;
  plan.slurm.least_job_s = 60;
  const auto stage = [&](const char* name, StageNeeds needs) {
    plan.stages.push_back(name);
    plan.needs[name] = needs;
  };
  const auto names = [&] {
    std::vector<std::vector<std::string>> all;
    for (const StageChain& chain : stage_chains(plan)) all.push_back(chain.stages);
    return all;
  };
  stage("a", {2, 1000, 10, false, 40});
  stage("b", {1, 4000, 5, false, 30});
  stage("c", {2, 2000, 10, false, 55});
  stage("d", {2, 2000, 10, false, 5});
  stage("e", {2, 2000, 10, false, 5});
  using Names = std::vector<std::vector<std::string>>;
  EXPECT_EQ(names(), (Names{{"a", "b"}, {"c", "d", "e"}})) << "a short rest joins";
  EXPECT_EQ(stage_chains(plan)[0].needs, (StageNeeds{2, 4000, 15, false, 70}));
  plan.needs["c"].usual_s.reset();
  EXPECT_EQ(names(), (Names{{"a", "b"}, {"c", "d", "e"}})) << "unknown counts as long";
  plan.needs["c"].gpu = true;
  EXPECT_EQ(names(), (Names{{"a", "b"}, {"c"}, {"d", "e"}}));
  plan.slurm.least_job_s = 0;
  EXPECT_EQ(names(), (Names{{"a"}, {"b"}, {"c"}, {"d"}, {"e"}}));
  plan.slurm.least_job_s = 1e9;
  plan.needs["c"].gpu = false;
  plan.needs["c"].usual_s = 55;
  EXPECT_EQ(names().size(), 1u);
}

TEST(StageChains, OfADefaultRunLastAMinuteAndMore) {
  FarmPlan plan;
  plan.stages = stages::stage_names();
  plan.needs = default_needs(plan.stages, 2, false);
  const auto chains = stage_chains(plan);
  EXPECT_GE(chains.size(), 2u);
  for (const StageChain& chain : chains) {
    EXPECT_GE(chain.needs.usual_s, plan.slurm.least_job_s);
    ASSERT_TRUE(chain.needs.usual_s) << "a stage without a measured time";
  }
}

TEST(Slurm, NotInstalledIsSaidWithAWayOut) {
  const auto output = slurm_output({"orbitfuse-no-such-sbatch"}, Progress{});
  ASSERT_FALSE(output);
  EXPECT_EQ(output.error().kind, ErrorKind::unavailable);
  EXPECT_THAT(output.error().remedy, HasSubstr("without --slurm"));
}

TEST(Slurm, ARefusalCarriesItsOwnWords) {
  const auto output =
      slurm_output({"sh", "-c", "echo 'invalid partition specified: x'; exit 1"}, Progress{});
  ASSERT_FALSE(output);
  EXPECT_EQ(output.error().kind, ErrorKind::usage);
  EXPECT_THAT(output.error().found, HasSubstr("invalid partition specified: x"));
}

}  // namespace
}  // namespace orbitfuse::farm
