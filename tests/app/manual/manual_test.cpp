// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <fstream>

#include "app/cli/command_line.hpp"
#include "app/manual/completion.hpp"
#include "app/manual/man_page.hpp"
#include "tests/app/cli/program.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::manual {
namespace {

using testing::HasSubstr;
using testing::Not;

const ManualFacts facts{.version = "1.2.3", .date = "2026-01-02", .introduction = "Words."};

std::string plain(std::string roff) {
  for (std::size_t at; (at = roff.find("\\-")) != std::string::npos;) roff.replace(at, 2, "-");
  return roff;
}

TEST(ManPages, TellEveryVerbAndOption) {
  const cli::CommandLine line;
  const std::vector<ManPage> pages = man_pages(line.app, facts);
  ASSERT_EQ(pages.size(), line.actions.size() + 1);
  EXPECT_EQ(pages[0].name, "orbitfuse");
  int options = 0;
  for (std::size_t i = 0; i < line.actions.size(); ++i) {
    const std::string name = line.actions[i].first->name, page = plain(pages[i + 1].text);
    EXPECT_EQ(pages[i + 1].name, "orbitfuse-" + name);
    EXPECT_THAT(plain(pages[0].text), HasSubstr("orbitfuse-" + name + " (1)"));
    for (const CLI::Option* option : line.app.get_subcommand(name)->get_options()) {
      EXPECT_THAT(page, HasSubstr(option->get_name(option->get_positional(), true))) << name;
      EXPECT_THAT(page, HasSubstr(plain(option->get_description()))) << name;
      ++options;
    }
  }
  EXPECT_GT(options, 100);
}

TEST(ManPages, TellTheReleaseAndTheIntroduction) {
  const std::string page = man_pages(cli::CommandLine().app, facts)[0].text;
  EXPECT_TRUE(page.starts_with(".TH ORBITFUSE 1 2026-01-02 \"OrbitFuse 1.2.3\""));
  EXPECT_THAT(page, HasSubstr("\nWords.\n"));
}

TEST(RoffOfMarkdown, SetsParagraphsTablesCodeAndLinks) {
  EXPECT_EQ(roff_of_markdown("# Title\n\nOne `--two` [three](four.md).\nMore.\n\nNext.\n"),
            "One \\fB\\-\\-two\\fR three.\nMore.\n.PP\nNext.\n");
  EXPECT_EQ(roff_of_markdown("| code | meaning |\n|---|---|\n| 0 | done |\n"), ".TP\n0\ndone\n");
}

/// What would be a command of roff, or end one, is text.
TEST(RoffOfMarkdown, TakesNothingForACommand) {
  EXPECT_EQ(roff_of_markdown(".so /etc/passwd\n"), "\\&.so /etc/passwd\n");
  EXPECT_EQ(roff_of_markdown("'br\n"), "\\&'br\n");
  EXPECT_EQ(roff_of_markdown("a \\n b\n"), "a \\en b\n");
  EXPECT_EQ(roff_of_markdown("`open and [shut\n"), "`open and [shut\n");
  EXPECT_EQ(roff_of_markdown("| | |\n|---|---|\n|||\n"), ".TP\n\n\n");
  EXPECT_EQ(roff_of_markdown(""), "");
}

class Completion : public testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(folder / "completion") << bash_completion(cli::CommandLine().app);
  }

  /// What bash offers for the last of the words; "|" where it stays with file names.
  std::string offered(const std::string& words) const {
    const Outcome outcome = run_program(
        {"bash", "-c",
         "set -u; source completion; COMP_WORDS=(" + words +
             "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _orbitfuse; echo \"|${COMPREPLY[*]}\""},
        {.folder = folder.path()});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    return outcome.out;
  }

  test::TempFolder folder;
};

TEST_F(Completion, OffersVerbsOptionsAndValues) {
  EXPECT_EQ(offered("orbitfuse me"), "|metrics measure\n");
  EXPECT_EQ(offered("orbitfuse --ver"), "|--version\n");
  EXPECT_EQ(offered("orbitfuse help re"), "|register render report replay\n");
  EXPECT_EQ(offered("orbitfuse fuse --meth"), "|--method\n");
  EXPECT_EQ(offered("orbitfuse fuse --method p"), "|pca-msif\n");
  EXPECT_EQ(offered("orbitfuse run --device ''"), "|cpu cuda\n");
}

TEST_F(Completion, LeavesFilesToBash) {
  EXPECT_EQ(offered("orbitfuse run ./some"), "|\n");
  EXPECT_EQ(offered("orbitfuse nonesuch --x"), "|\n");
  EXPECT_EQ(offered("orbitfuse run --config ''"), "|\n");
}

}  // namespace
}  // namespace orbitfuse::manual
