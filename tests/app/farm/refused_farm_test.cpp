// SPDX-License-Identifier: BSD-3-Clause
// What `orbitfuse farm` says, with which exit code, where there is no Slurm, where Slurm refuses,
// on a full folder, on a dead mount and beside another farm: named, and nothing is lost.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <unistd.h>

#include <chrono>

#include "app/farm/farm_lock.hpp"
#include "tests/app/cli/program.hpp"
#include "tests/app/cli/session_fixture.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {
namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

class RefusedFarm : public ::testing::Test {
 protected:
  RefusedFarm() { fs::create_directories(session); }

  /// One of Slurm's commands, as a script. `calls` gets a line a call.
  void command(const std::string& name, const std::string& body) const {
    test::put_program(temp / "bin" / name,
                      "#!/bin/sh\necho " + name + " \"$@\" >> " + calls.string() + "\n" + body);
  }
  /// Only Slurm's commands of this test are on PATH.
  Outcome farm(std::vector<std::string> words) const {
    words.insert(words.begin(), "farm");
    fs::create_directories(temp / "bin");
    return orbitfuse_program(words, {.environment = {"PATH=" + (temp / "bin").string()}});
  }
  Outcome start(std::vector<std::string> more) const {
    more.insert(more.begin(), {session.string(), "--out", out.string()});
    return farm(more);
  }

  const test::TempFolder temp;
  const fs::path session = temp / "visit", out = temp / "farm", calls = temp / "calls";
};

TEST_F(RefusedFarm, WithoutSlurmTheFolderStaysFreeForAFarmOfThisMachine) {
  const Outcome refused = start({"--slurm"});
  EXPECT_EQ(refused.code, 6) << refused.err;
  EXPECT_THAT(refused.err, AllOf(HasSubstr("sbatch"), HasSubstr("without --slurm")));
  EXPECT_FALSE(fs::exists(out / "farm.json"));
  EXPECT_FALSE(fs::exists(out / "farm.lock"));
  const Outcome here = start({});
  EXPECT_EQ(here.code, 5) << here.err;  // an empty session, named
  EXPECT_THAT(test::get(out / "farm.csv"), HasSubstr("visit,failed,poses_visible,"));
}

TEST_F(RefusedFarm, ADryRunOfAnOrderOnlyTellsHowTheFarmStands) {
  ASSERT_EQ(start({}).code, 5);
  const std::string plan = test::get(out / "farm.json");
  fs::remove(out / "farm.html");
  for (const char* order : {"resume", "cancel", "status"}) {
    const Outcome told = farm({order, out.string(), "--dry-run"});
    EXPECT_EQ(told.code, 0) << told.err;
    EXPECT_THAT(told.out, HasSubstr("visit"));
    EXPECT_FALSE(fs::exists(out / "farm.html")) << order;
    EXPECT_EQ(test::get(out / "farm.json"), plan);
  }
}

/// Killed, or without power: its records say "running" for ever.
TEST_F(RefusedFarm, AFarmThatDiedIsNotSaidToRun) {
  ASSERT_EQ(start({}).code, 5);
  const fs::path record = out / ".farm/visit/poses_visible.json";
  nlohmann::json outcome = nlohmann::json::parse(test::get(record));
  outcome["state"] = "running";
  test::put(record, outcome.dump());
  const Outcome dead = farm({"status", out.string()});
  EXPECT_THAT(dead.err, AllOf(HasSubstr("no farm works in"), HasSubstr("farm resume")));
  outcome["state"] = "failed";
  test::put(record, outcome.dump());
  EXPECT_THAT(farm({"status", out.string()}).err, testing::Not(HasSubstr("no farm works in")));
}

TEST_F(RefusedFarm, ADryRunIsRefusedWhereTheStartWouldBe) {
  ASSERT_EQ(start({}).code, 5);
  for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--dry-run"}}) {
    const Outcome again = start(more);
    EXPECT_EQ(again.code, 2) << again.err;
    EXPECT_THAT(again.err, HasSubstr("a farm was started in it before"));
  }
}

TEST_F(RefusedFarm, CancellingWhatIsNoFarmMakesNoFolder) {
  const Outcome refused = farm({"cancel", out.string()});
  EXPECT_EQ(refused.code, 3) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("no farm"));
  EXPECT_FALSE(fs::exists(out));
}

TEST_F(RefusedFarm, LimitsBelowWhatAStageNeedsAreNamedBeforeTheStart) {
  for (const auto& [more, said] : std::vector<std::pair<std::vector<std::string>, const char*>>{
           {{"--memory", "10"}, "stage poses_visible: needs 2000 MB, --memory is 10; give more"},
           {{"--cores", "1"}, "stage poses_visible: needs 2 cores, --cores is 1; give more"},
           {{"--memory", "nan"}, "--memory: nan; choose 0 or more"},
           {{"--workers", "-1"}, "--workers: -1; choose 0 or more"},
           {{"--like", (temp / "nothere").string()}, "name the --out folder of an earlier farm"}}) {
    for (const bool dry : {false, true}) {
      std::vector<std::string> words = more;
      if (dry) words.emplace_back("--dry-run");
      const Outcome refused = start(words);
      EXPECT_EQ(refused.code, more[0] == "--like" ? 3 : 2) << refused.err;
      EXPECT_THAT(refused.err, HasSubstr(said));
      EXPECT_FALSE(fs::exists(out));
    }
  }
  ASSERT_EQ(start({}).code, 5);
  const Outcome resumed = farm({"resume", out.string(), "--memory", "10"});
  EXPECT_EQ(resumed.code, 2) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("--memory is 10"));
}

TEST_F(RefusedFarm, JobsOfAGpuNeedADeviceAndThisMachine) {
  for (const auto& [more, said] : std::vector<std::pair<std::vector<std::string>, const char*>>{
           {{"--gpu-jobs", "2"}, "--gpu-jobs: no stage uses a GPU with --device cpu"},
           {{"--gpu-jobs", "0", "--device", "cuda"}, "--gpu-jobs: 0; choose 1 or more"},
           {{"--gpu-jobs", "2", "--device", "cuda", "--slurm"}, "--slurm"}}) {
    const Outcome refused = start(more);
    EXPECT_EQ(refused.code, 2) << refused.err;
    EXPECT_THAT(refused.err, HasSubstr(said));
    EXPECT_FALSE(fs::exists(out));
  }
}

TEST_F(RefusedFarm, ASlipInAnOrderIsToldApartFromASession) {
  const Outcome refused = farm({"stauts", out.string()});
  EXPECT_EQ(refused.code, 2) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("did you mean 'status'?"));
}

TEST_F(RefusedFarm, APartitionThatSlurmRefusesIsNamedAndTheNextTryIsTaken) {
  command("sbatch",
          "for word; do [ \"$word\" = --partition=nowhere ] && { echo 'sbatch: error: invalid "
          "partition specified: nowhere'; exit 1; }; done\necho 17\n");
  const Outcome refused = start({"--slurm", "--partition", "nowhere"});
  EXPECT_EQ(refused.code, 2) << refused.err;
  EXPECT_THAT(refused.err, AllOf(HasSubstr("invalid partition specified: nowhere"),
                                 HasSubstr("sinfo lists partitions")));
  EXPECT_FALSE(fs::exists(out / "farm.json"));
  EXPECT_EQ(start({"--slurm", "--partition", "day"}).code, 0);
  EXPECT_THAT(test::get(out / "farm.json"), HasSubstr("\"17\""));
}

TEST_F(RefusedFarm, ARefusalAfterTheFirstArraysTakesThemBack) {
  // The number of calls so far, counted without a program that PATH does not hold.
  command("sbatch", "n=0; while read -r name rest; do [ $name = sbatch ] && n=$((n + 1)); done < " +
                        calls.string() +
                        "\n[ $n -lt 3 ] && { echo 2$n; exit 0; }\n"
                        "echo 'sbatch: error: QOSMaxSubmitJobPerUserLimit'\nexit 1\n");
  command("scancel", "");
  const Outcome refused = start({"--slurm"});
  EXPECT_EQ(refused.code, 2) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("QOSMaxSubmitJobPerUserLimit"));
  EXPECT_THAT(test::get(calls), HasSubstr("scancel 21 22\n"));
  EXPECT_FALSE(fs::exists(out / "farm.json"));
}

TEST_F(RefusedFarm, ASecondFarmLeavesTheFirstAsItIs) {
  command("sbatch", "echo 31\n");
  command("squeue", "echo '31 " + out.string() + "'\n");
  ASSERT_EQ(start({"--slurm"}).code, 0);
  const std::string plan = test::get(out / "farm.json");
  for (const bool on_slurm : {true, false}) {
    const Outcome second =
        start(on_slurm ? std::vector<std::string>{"--slurm"} : std::vector<std::string>{});
    EXPECT_EQ(second.code, 2) << second.err;
    EXPECT_THAT(second.err, HasSubstr("a farm was started in it before"));
  }
  const Outcome resumed = farm({"resume", out.string()});
  EXPECT_EQ(resumed.code, 2) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("1 of its jobs still wait or run in Slurm"));
  {
    farm::FarmLock held;  // by this process, which is alive
    ASSERT_TRUE(held.acquire(out));
    for (const char* order : {"resume", "cancel"}) {
      const Outcome beside = farm({order, out.string()});
      EXPECT_EQ(beside.code, 2) << beside.err;
      EXPECT_THAT(beside.err, HasSubstr(std::to_string(getpid())));
    }
  }
  EXPECT_EQ(test::get(out / "farm.json"), plan);
}

TEST_F(RefusedFarm, AFullFolderNamesTheFileAndKeepsWhatIsDone) {
  fs::remove(session);
  write_fixture_session(session);
  fs::create_directories(out);
  // Full before it starts; then with room for the records, but not for the first stage's results.
  const std::string program = ORBITFUSE_BINARY_DIR "/app/orbitfuse",
                    farm = " farm " + session.string() + " --out " + out.string() + "/farm";
  const std::string script = "mount -t tmpfs -o size=600k tmpfs " + out.string() + " || exit 99\n" +
                             "dd if=/dev/zero of=" + out.string() +
                             "/others bs=4k 2> /dev/null\n" +  //
                             program + farm + "\n[ $? = 4 ] || exit 90\n[ ! -e " + out.string() +
                             "/farm/farm.json ] || exit 91\nrm " + out.string() + "/others\n" +  //
                             program + farm + "\n[ $? = 5 ] || exit 92\n" +                      //
                             "cat " + out.string() + "/farm/.farm/visit/*.json\n";
  const Outcome outcome = run_program({"unshare", "-rm", "sh", "-c", script});
  if (outcome.code == 99 || outcome.code == 1)
    GTEST_SKIP() << "this machine allows no private mounts: " << outcome.err;
  EXPECT_EQ(outcome.code, 0) << outcome.err << outcome.out;
  EXPECT_THAT(outcome.err,
              AllOf(HasSubstr("No space left on device"), HasSubstr("free disk space")));
  EXPECT_THAT(outcome.out,
              AllOf(HasSubstr("No space left on device"), HasSubstr("\"state\":\"failed\""),
                    ::testing::Not(HasSubstr("\"starts\":2"))))
      << "a full folder is no cause to try again";
}

/// A file system that nobody answers for, as of a server that has gone: FUSE without a program.
class DeadMount {
 public:
  explicit DeadMount(const fs::path& folder) : folder_(folder) {
    fs::create_directories(folder);
    // A mount of this process and its children: it ends with them.
    if (unshare(CLONE_NEWNS) != 0 || mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0)
      return;
    device_ = open("/dev/fuse", O_RDWR | O_CLOEXEC);
    if (device_ < 0) return;
    const std::string data =
        "fd=" + std::to_string(device_) + ",rootmode=40000,user_id=0,group_id=0";
    is_here_ = mount("dead", folder.c_str(), "fuse", MS_NOSUID | MS_NODEV, data.c_str()) == 0;
  }
  DeadMount(const DeadMount&) = delete;
  DeadMount& operator=(const DeadMount&) = delete;
  ~DeadMount() {
    if (device_ >= 0) close(device_);  // whoever waits for it is let go
    if (is_here_) umount2(folder_.c_str(), MNT_DETACH);
  }
  bool is_here() const { return is_here_; }

 private:
  fs::path folder_;
  int device_ = -1;
  bool is_here_ = false;
};

TEST_F(RefusedFarm, ADeadMountIsNamedInsteadOfHangingForEver) {
  const DeadMount dead(temp / "gone");
  if (!dead.is_here()) GTEST_SKIP() << "this machine allows no FUSE mounts";
  const Outcome refused = farm({session.string(), "--out", (temp / "gone/farm").string()});
  EXPECT_EQ(refused.code, 4) << refused.err;
  EXPECT_THAT(refused.err, AllOf(HasSubstr((temp / "gone/farm").string()),
                                 HasSubstr("does not answer"), HasSubstr("nothing was changed")));
}

}  // namespace
}  // namespace orbitfuse
