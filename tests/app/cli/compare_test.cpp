// SPDX-License-Identifier: BSD-3-Clause
// `orbitfuse compare` on small runs of the real program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <tuple>

#include "core/system/file_io.hpp"
#include "tests/app/cli/program.hpp"
#include "tests/app/cli/small_run.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

constexpr double warmer_k = 6;

/// The same box twice, the second time warmer all over.
class Compare : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder = std::make_unique<test::TempFolder>();
    copy_results(made_run(), *folder / "before");
    copy_results(made_run(warmer_k), *folder / "after");
    fs::copy(made_run(warmer_k).session, *folder / "after_session", fs::copy_options::recursive);
  }
  static void TearDownTestSuite() { folder.reset(); }

  static Outcome compare(const std::string& before, const std::string& after,
                         std::vector<std::string> more) {
    more.insert(more.begin(), {"compare", (*folder / before).string(), (*folder / after).string()});
    return orbitfuse_program(more);
  }

  static std::unique_ptr<test::TempFolder> folder;
};
std::unique_ptr<test::TempFolder> Compare::folder;

TEST_F(Compare, WhatBothDaysDifferByIsFoundAndCanBeTakenOut) {
  const fs::path out = *folder / "plain";
  const Outcome plain = compare("before", "after", {"--out", out.string(), "--json"});
  ASSERT_EQ(plain.code, 0) << plain.err;
  const json found = plain.result().at("comparison");
  EXPECT_NEAR(found.at("common_difference_k").get<double>(), warmer_k, 0.1);
  EXPECT_EQ(found.at("taken_out_k"), 0);
  EXPECT_GT(found.at("surface_shares").at("compared").get<double>(), 0.9);
  EXPECT_TRUE(found.at("came").empty() && found.at("gone").empty()) << found;
  ASSERT_GE(found.at("differences").size(), 1u);
  const json first = found.at("differences")[0];
  EXPECT_NEAR(first.at("difference_k").get<double>(), warmer_k, 0.5);
  EXPECT_GT(first.at("uncertainty_k").get<double>(), 0);
  // What is told is what is written, and the page stands alone.
  EXPECT_EQ(json::parse(test::get(out / "differences.json")), found);
  EXPECT_THAT(test::get(out / "compare.html"), HasSubstr("nothing was taken out"));

  const Outcome ambient =
      compare("before", "after", {"--out", (*folder / "taken").string(), "--ambient", "--json"});
  ASSERT_EQ(ambient.code, 0) << ambient.err;
  EXPECT_NEAR(ambient.result().at("comparison").at("taken_out_k").get<double>(), warmer_k, 0.1);
  EXPECT_TRUE(ambient.result().at("comparison").at("differences").empty());
}

TEST_F(Compare, ADryRunLooksAtBothRunsAndWritesNothing) {
  const fs::path out = *folder / "dry";
  const Outcome dry = compare("before", "after", {"--out", out.string(), "--dry-run"});
  EXPECT_EQ(dry.code, 0) << dry.err;
  EXPECT_THAT(dry.err, HasSubstr("both runs hold what a comparison needs"));
  EXPECT_FALSE(fs::exists(out));
  EXPECT_NE(compare("before", "after_session", {"--out", out.string(), "--dry-run"}).code, 0);
}

TEST_F(Compare, TwoRunsOfOneSessionCannotTellOfTheObject) {
  const fs::path out = *folder / "same";
  copy_results(made_run(), *folder / "again");
  const char* said = "both runs are of one session";
  EXPECT_THAT(compare("before", "again", {"--out", out.string(), "--dry-run"}).err,
              HasSubstr(said));
  EXPECT_THAT(compare("before", "after", {"--out", out.string(), "--dry-run"}).err,
              testing::Not(HasSubstr(said)));
}

TEST_F(Compare, ScalesOfBothRunsAreOneOrNone) {
  const std::string before = (*folder / "before").string(), after = (*folder / "after").string();
  const auto tell = [&](const std::string& run, const std::string& metres) {
    const Outcome told = orbitfuse_program(
        {"export", run, "--to", run + ".ply", "--distance", "0,0,0", "0.5,0,0", metres});
    ASSERT_EQ(told.code, 0) << told.err;
  };
  const auto compared = [&](const char* name) {
    const Outcome done = compare("before", "after", {"--out", (*folder / name).string(), "--json"});
    EXPECT_EQ(done.code, 0) << done.err;
    return std::pair(done.result().at("comparison"), done.err);
  };
  EXPECT_EQ(compared("no_scale").first.at("unit"), "scene");
  EXPECT_THAT(orbitfuse_program({"inspect", before}).out, HasSubstr("no scale in metres"));
  EXPECT_THAT(test::get(fs::path(before) / "report/report.html"), HasSubstr("no scale"));

  tell(before, "1.00m");
  EXPECT_EQ(compared("one_scale").first.at("unit"), "metre");
  const Outcome told = orbitfuse_program({"inspect", before, "--json"});
  EXPECT_EQ(told.code, 0) << told.err;
  EXPECT_NEAR(told.result().at("scale").at("metres_per_unit").get<double>(), 2, 1e-9);
  tell(after, "1.00m");
  EXPECT_THAT(compared("both_scales").first.at("scale").at("how").get<std::string>(),
              HasSubstr("0.5000 units are 1.0000 m"));

  tell(after, "1.50m");
  const auto [contradicted, said] = compared("two_scales");
  EXPECT_EQ(contradicted.at("unit"), "scene");
  EXPECT_THAT(said, HasSubstr("contradict each other"));
  EXPECT_THAT(said, HasSubstr("tell one again"));
  EXPECT_THAT(test::get(*folder / "two_scales" / "compare.html"), HasSubstr("contradict"));

  ASSERT_TRUE(write_file_atomic(fs::path(before) / "scale.json", "{"));
  const Outcome dry = compare("before", "after", {"--out", (*folder / "d").string(), "--dry-run"});
  EXPECT_EQ(dry.code, 3);
  EXPECT_THAT(dry.err, HasSubstr("--distance A B LENGTH"));
  EXPECT_EQ(orbitfuse_program({"inspect", before}).code, 3);
  for (const std::string& run : {before, after}) fs::remove(fs::path(run) / "scale.json");
}

TEST_F(Compare, WhatCannotBeComparedIsNamedAndNothingIsWritten) {
  const fs::path out = *folder / "refused";
  const std::string before = (*folder / "before").string();
  for (const auto& [after, into, code, said] :
       {std::tuple("before", out, 2, "the two runs are the same"),
        std::tuple("after", *folder / "after", 2, "which is one of the runs"),
        std::tuple("after_session", out, 3, "after_session"), std::tuple("none", out, 3, "none")}) {
    const Outcome refused = compare("before", after, {"--out", into.string()});
    EXPECT_EQ(refused.code, code) << after << refused.out << refused.err;
    EXPECT_THAT(refused.err, HasSubstr(said));
    EXPECT_EQ(refused.out, "");
    EXPECT_FALSE(fs::exists(out));
  }
  EXPECT_TRUE(fs::exists(fs::path(before) / "run.json"));
}

}  // namespace
}  // namespace orbitfuse
