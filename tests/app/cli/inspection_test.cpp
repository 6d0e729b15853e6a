// SPDX-License-Identifier: BSD-3-Clause
// `orbitfuse report --inspection` on a small run of the real program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "tests/app/cli/program.hpp"
#include "tests/app/cli/small_run.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

class Inspection : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder = std::make_unique<test::TempFolder>();
    copy_results(made_run(), out());
  }
  static void TearDownTestSuite() { folder.reset(); }

  static fs::path out() { return *folder / "out"; }
  static fs::path html() { return out() / "inspection.html"; }
  static fs::path toml() { return *folder / "details.toml"; }
  static Outcome measure(std::vector<std::string> more) {
    more.insert(more.begin(), {"measure", out().string()});
    return orbitfuse_program(more);
  }
  static Outcome inspect(const std::string& details, std::vector<std::string> more = {}) {
    test::put(toml(), details);
    more.insert(more.begin(), {"report", out().string(), "--inspection", toml().string()});
    return orbitfuse_program(more);
  }

  static std::unique_ptr<test::TempFolder> folder;
};
std::unique_ptr<test::TempFolder> Inspection::folder;

TEST_F(Inspection, ShowsTheSavedMeasurementsOfTheRun) {
  const Outcome empty = inspect("");
  EXPECT_EQ(empty.code, 0) << empty.err;
  EXPECT_THAT(empty.err, HasSubstr("no findings"));

  ASSERT_EQ(measure({"--hottest", "2", "--save", "--name", "hot <b>", "--remark", "glows"}).code,
            0);
  ASSERT_EQ(measure({"--pixel", "000,32,24", "--save", "--name", "front"}).code, 0);
  const Outcome made = inspect(
      "[inspection]\nobject = \"the box\"\n[[finding]]\nmeasurement = \"hot <b>\"\n"
      "reference = \"front\"\n");
  ASSERT_EQ(made.code, 0) << made.err;
  const std::string page = test::get(html());
  for (const char* said :
       {"the box", "hot &lt;b&gt;", "glows", "Difference against &#39;front&#39;", "not recorded",
        "<svg", "Seen best by thermal/0000", "Emissivity not recorded", "fixture"})
    EXPECT_THAT(page, HasSubstr(said));
  EXPECT_THAT(page, Not(HasSubstr("hot <b>")));
  // Two findings of three pictures each, and the plan's two drawings.
  std::size_t pictures = 0;
  for (std::size_t at = 0; (at = page.find("data:image/jpeg", at)) != std::string::npos; ++at)
    ++pictures;
  EXPECT_EQ(pictures, 8u);

  // The ordinary report lists them too.
  ASSERT_EQ(orbitfuse_program({"report", out().string()}).code, 0);
  const std::string report = test::get(out() / "report/report.html");
  EXPECT_THAT(report, HasSubstr("Saved measurements"));
  EXPECT_THAT(report, HasSubstr("hot &lt;b&gt;, place 2"));

  // What is wrong is said, and the report of before stays.
  struct Wrong {
    const char* toml;
    int code;
    const char* said;
  };
  for (const Wrong& wrong :
       {Wrong{"[inspection]\nobject = 5", 2, "details.toml:2"},
        Wrong{"[[finding]]\nmeasurement = \"fromt\"", 2, "did you mean 'front'?"},
        Wrong{"[[finding]]\nmeasurement = \"front\"\nreference = \"gone\"", 2, "'gone'"}}) {
    const Outcome refused = inspect(wrong.toml);
    EXPECT_EQ(refused.code, wrong.code) << refused.err;
    EXPECT_THAT(refused.err, HasSubstr(wrong.said));
  }
  json foreign = json::parse(test::get(out() / "measurements.json"));
  foreign["run"] = "another";
  test::put(out() / "measurements.json", foreign.dump());
  const Outcome refused = inspect("");
  EXPECT_EQ(refused.code, 3) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("another run"));
  EXPECT_EQ(test::get(html()), page);
  // The ordinary report goes on without them, and says so.
  ASSERT_EQ(orbitfuse_program({"report", out().string()}).code, 0);
  EXPECT_THAT(test::get(out() / "report/report.html"),
              HasSubstr("saved measurements are not shown"));
}

TEST(InspectionWords, WithoutARunOrDetailsSayWhatToDo) {
  const test::TempFolder folder;
  const Outcome printed = orbitfuse_program({"report", "--print-template"});
  EXPECT_EQ(printed.code, 0) << printed.err;
  EXPECT_THAT(printed.out, HasSubstr("[inspection]"));
  const Outcome pdf = orbitfuse_program({"report", "x", "--pdf"});
  EXPECT_EQ(pdf.code, 2);
  EXPECT_THAT(pdf.err, HasSubstr("--inspection"));
  test::put(folder / "details.toml", "");
  const Outcome nowhere = orbitfuse_program({"report", (folder / "nowhere").string(),
                                             "--inspection", (folder / "details.toml").string()});
  EXPECT_EQ(nowhere.code, 3) << nowhere.err;
  EXPECT_THAT(nowhere.err, HasSubstr("nowhere"));
}

}  // namespace
}  // namespace orbitfuse
