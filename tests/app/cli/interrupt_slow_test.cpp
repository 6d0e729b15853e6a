// SPDX-License-Identifier: BSD-3-Clause
// The whole job on the recorded orbit, broken off in every stage: what --resume ends with is what
// an unbroken run ends with, byte for byte.
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "core/system/file_io.hpp"
#include "tests/app/cli/program.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {
namespace fs = std::filesystem;

Outcome run_car(const fs::path& out, const std::string& interrupt_after = {}) {
  std::vector<std::string> words = {
      "run", ORBITFUSE_SOURCE_DIR "/replay_data/car", "--out", out.string(), "--json", "--resume"};
  for (const char* set : {"train.visible.iterations=300", "train.thermal.iterations=100",
                          "train.visible.eval_count=0", "train.thermal.eval_count=0",
                          "render.views=4", "render.width_px=160"})
    words.insert(words.end(), {"--set", set});
  return orbitfuse_program(words, {.interrupt_after = interrupt_after});
}

/// Hashes of all results; what tells of times (records of stages and run, training curves, the
/// report) is left out.
std::map<std::string, std::string> results(const fs::path& out) {
  const std::set<std::string> timed = {"stage.json", "run.json", "report.html", "curve.json"};
  std::map<std::string, std::string> hashes;
  for (const auto& entry : fs::recursive_directory_iterator(out)) {
    if (!entry.is_regular_file() || timed.contains(entry.path().filename())) continue;
    const auto hash = file_hash(entry.path());
    EXPECT_TRUE(hash) << entry.path();
    if (hash) hashes[fs::relative(entry.path(), out)] = *hash;
  }
  return hashes;
}

TEST(Interrupt, InEveryStageThenResumedEqualsUnbroken) {
  const test::TempFolder temp;
  int interruptions = 0;
  // What each stage prints on its way, in the order of the stages.
  for (const char* sign :
       {"\"stage\":\"poses.visible\"", "matches of the orbit's pairs",
        "\"stage\":\"depth\",\"total\"", "training views", "\"stage\":\"export\"",
        "alignment with renders", "\"stage\":\"train.thermal\"", "\"stage\":\"register\"",
        "\"stage\":\"render\",\"total\"", "\"stage\":\"metrics\",\"total\""}) {
    const Outcome stopped = run_car(temp.path() / "broken", sign);
    if (stopped.code == 0) break;  // the last stages may end before the signal reaches them
    ASSERT_EQ(stopped.code, 130) << sign << '\n' << stopped.err;
    ++interruptions;
  }
  EXPECT_GE(interruptions, 7) << "the stages up to the thermal field take long enough";
  ASSERT_EQ(run_car(temp.path() / "broken").code, 0);
  ASSERT_EQ(run_car(temp.path() / "unbroken").code, 0);
  const auto broken = results(temp.path() / "broken"), unbroken = results(temp.path() / "unbroken");
  EXPECT_GT(unbroken.size(), 50u);
  for (const auto& [file, hash] : unbroken) {
    const auto found = broken.find(file);
    ASSERT_TRUE(found != broken.end()) << file;
    EXPECT_EQ(found->second, hash) << file;
  }
  EXPECT_EQ(broken.size(), unbroken.size());
}

}  // namespace
}  // namespace orbitfuse
