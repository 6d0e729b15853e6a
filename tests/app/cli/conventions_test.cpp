// SPDX-License-Identifier: BSD-3-Clause
// What every verb promises: help, exit codes, streams, --json, configuration.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <regex>

#include "core/system/file_io.hpp"
#include "tests/app/cli/program.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {
using testing::HasSubstr;
using testing::StartsWith;

const std::vector<std::string> verbs = {
    "run",     "import", "inspect", "poses",  "train",   "register", "render", "fuse",
    "metrics", "report", "eval",    "replay", "capture", "devices",  "mat",    "doctor"};

TEST(Cli, HelpBeginsWithAnExampleAndGoesToStdout) {
  for (const std::string& verb : verbs) {
    const Outcome help = orbitfuse_program({verb, "--help"});
    EXPECT_EQ(help.code, 0) << verb;
    EXPECT_THAT(help.out, StartsWith("Example:\n  orbitfuse " + verb));
    EXPECT_EQ(help.err, "") << verb;
    for (const char* common :
         {"--json", "--threads", "--device", "--dry-run", "--verbose", "--quiet"})
      EXPECT_THAT(help.out, HasSubstr(common)) << verb;
  }
}

TEST(Cli, TopLevelHelpListsEveryVerb) {
  const Outcome help = orbitfuse_program({"--help"});
  EXPECT_EQ(help.code, 0);
  for (const std::string& verb : verbs) EXPECT_THAT(help.out, HasSubstr("\n  " + verb + " "));
  EXPECT_EQ(orbitfuse_program({"help"}).out, help.out);
  EXPECT_EQ(orbitfuse_program({"help", "capture"}).out,
            orbitfuse_program({"capture", "--help"}).out);
  EXPECT_EQ(orbitfuse_program({"help", "captrue"}).code, 2);
  EXPECT_THAT(help.out, HasSubstr("orbitfuse help VERB"));
}

TEST(Cli, Version) {
  const Outcome version = orbitfuse_program({"--version"});
  EXPECT_EQ(version.code, 0);
  EXPECT_TRUE(std::regex_match(version.out, std::regex("orbitfuse \\d+\\.\\d+\\.\\d+\n")));
}

TEST(Cli, SlipsGetASuggestionAndExitCode2) {
  const Outcome verb = orbitfuse_program({"trian", "x"});
  EXPECT_EQ(verb.code, 2);
  EXPECT_THAT(verb.err, HasSubstr("did you mean 'train'?"));
  const Outcome option = orbitfuse_program({"run", "x", "--thread", "2"});
  EXPECT_EQ(option.code, 2);
  EXPECT_THAT(option.err, HasSubstr("did you mean '--threads'?"));
  EXPECT_EQ(option.out, "");
  EXPECT_EQ(orbitfuse_program({}).code, 2);
  EXPECT_EQ(orbitfuse_program({"run"}).code, 2);
  EXPECT_EQ(orbitfuse_program({"run", "x", "--threads", "many"}).code, 2);
  EXPECT_EQ(orbitfuse_program({"run", "x", "--device", "tpu"}).code, 2);
  EXPECT_EQ(orbitfuse_program({"run", "x", "--seed", "-1"}).code, 2);
}

TEST(Cli, WhatIsMissingOrMisplacedIsSaidPlainly) {
  const std::vector<std::pair<std::vector<std::string>, const char*>> slips = {
      {{"export", "--out", "x"}, "--out: the run's folder is given without an option"},
      {{"measure", "--out", "x"}, "write orbitfuse measure OUT"},
      {{"export"}, "out: not given: The --out folder of a finished run"},
      {{"export"}, "e.g. orbitfuse export out/ --to van.glb"},
      {{"fuse", "a.jpg", "b.jpg"}, "images are named by options: --visible and --thermal"},
      {{"import", "s", "photos"}, "images are named by options: --visible and --thermal"},
      {{"measure", "x", "--hottest"}, "--hottest: given without a value; write --hottest N"},
      {{"capture", "s", "--visible", "/dev/video0", "--dry-run"},
       "did you mean 'v4l2:/dev/video0'?"}};
  for (const auto& [words, said] : slips) {
    const Outcome outcome = orbitfuse_program(words);
    EXPECT_EQ(outcome.code, 2) << said;
    EXPECT_THAT(outcome.err, HasSubstr(said));
  }
}

TEST(Cli, UsageErrorsKeepTheJsonContract) {
  const Outcome outcome = orbitfuse_program({"run", "x", "--nonsense", "--json"});
  EXPECT_EQ(outcome.code, 2);
  const auto result = outcome.result();
  EXPECT_EQ(result.at("event"), "result");
  EXPECT_EQ(result.at("ok"), false);
  EXPECT_EQ(result.at("exit_code"), 2);
  EXPECT_EQ(result.at("schema"), 1);
}

TEST(Cli, WithoutACudaDeviceTheProcessorComputesAndSaysSo) {
  const Outcome outcome = orbitfuse_program({"doctor", "--device", "cuda"});
  EXPECT_EQ(outcome.code, orbitfuse_program({"doctor"}).code);
  EXPECT_THAT(outcome.err, testing::AnyOf(HasSubstr("; the processor computes"),
                                          HasSubstr("fields are computed on ")));
}

TEST(Cli, ConfigMistakesNameFileLineAndKey) {
  const test::TempFolder temp;
  const auto file = temp.path() / "c.toml";
  std::ofstream(file) << "[render]\nviewz = 3\n";
  const Outcome outcome = orbitfuse_program({"run", "x", "--config", file.string()});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("c.toml:2"));
  EXPECT_THAT(outcome.err, HasSubstr("did you mean 'render.views'?"));
  EXPECT_EQ(orbitfuse_program({"run", "x", "--config", "/none.toml"}).code, 3);
  const Outcome range = orbitfuse_program({"run", "x", "--set", "render.views=-3"});
  EXPECT_EQ(range.code, 2);
  EXPECT_THAT(range.err, HasSubstr("render.views: -3; choose 1 to 10000"));
}

TEST(Cli, ShippedConfigHoldsTheBuiltInDefaults) {
  const Outcome printed = orbitfuse_program({"run", "--print-config"});
  ASSERT_EQ(printed.code, 0);
  const auto shipped = read_file(ORBITFUSE_SOURCE_DIR "/config/orbitfuse.toml");
  ASSERT_TRUE(shipped);
  EXPECT_THAT(*shipped, HasSubstr(printed.out)) << "regenerate with: cmake/write_reference.sh";
  const Outcome again = orbitfuse_program(
      {"run", "--print-config", "--config", ORBITFUSE_SOURCE_DIR "/config/orbitfuse.toml"});
  EXPECT_EQ(again.out, printed.out);
}

/// A recipe's field that was changed is part of what is run.
TEST(Cli, PrintedConfigHoldsTheRecipesChangedFields) {
  const Outcome printed =
      orbitfuse_program({"run", "--print-config", "--set", "train.visible.iterations=123"});
  ASSERT_EQ(printed.code, 0) << printed.err;
  const std::size_t visible = printed.out.find("[train.visible]");
  ASSERT_NE(visible, std::string::npos);
  EXPECT_LT(printed.out.find("\niterations = 123\n", visible),
            printed.out.find("\n[", visible + 1));
  EXPECT_EQ(printed.out.find("iterations = 123"), printed.out.rfind("iterations = 123"));
  const test::TempFolder temp;
  std::ofstream(temp / "mine.toml") << printed.out;
  const Outcome again =
      orbitfuse_program({"run", "--print-config", "--config", temp / "mine.toml"});
  EXPECT_EQ(again.out, printed.out);
}

TEST(Cli, ATraceIsWrittenForAnyVerb) {
  const test::TempFolder temp;
  const std::string file = temp / "trace.json";
  EXPECT_EQ(orbitfuse_program({"devices", "--trace", file}).code, 0);
  const auto text = read_file(file);
  ASSERT_TRUE(text);
  EXPECT_THAT(*text, HasSubstr("\"name\":\"devices\""));
  const Outcome refused = orbitfuse_program({"devices", "--trace", "/proc/none/trace.json"});
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("/proc/none"));
  EXPECT_TRUE(refused.out.empty()) << "refused before the work";
}

TEST(Cli, ATraceOntoAFolderIsRefusedBeforeTheWork) {
  const test::TempFolder temp;
  const Outcome refused = orbitfuse_program({"devices", "--trace", temp.path().string()});
  EXPECT_EQ(refused.code, 2);
  EXPECT_TRUE(refused.out.empty());
}

/// The folder a verb makes is not made for it.
TEST(Cli, ATraceMakesNoFolderAndADryRunNoTrace) {
  const test::TempFolder temp;
  const std::string photos = temp / "photos", session = temp / "session";
  std::filesystem::create_directories(photos);
  const Outcome inside = orbitfuse_program(
      {"import", session, "--visible", photos, "--trace", session + "/trace.json"});
  EXPECT_EQ(inside.code, 2);
  EXPECT_FALSE(std::filesystem::exists(session));
  const std::string file = temp / "trace.json";
  EXPECT_EQ(orbitfuse_program({"devices", "--dry-run", "--trace", file}).code, 0);
  EXPECT_FALSE(std::filesystem::exists(file));
}

TEST(Cli, AMisspeltInstructionSetIsAnError) {
  const Outcome outcome = orbitfuse_program({"devices"}, {.environment = {"ORBITFUSE_ISA=avx-2"}});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("ORBITFUSE_ISA: avx-2; write avx2, avx512"));
}

TEST(Cli, ReferenceMatchesHelp) {
  const auto reference = read_file(ORBITFUSE_SOURCE_DIR "/docs/cli.md");
  ASSERT_TRUE(reference);
  const auto expect_quoted = [&](const std::vector<std::string>& arguments) {
    std::string help = orbitfuse_program(arguments).out;
    help.erase(help.find_last_not_of('\n') + 1);
    EXPECT_THAT(*reference, HasSubstr("```\n" + help + "\n```"))
        << "regenerate with: cmake/write_reference.sh";
  };
  expect_quoted({"--help"});
  for (const std::string& verb : verbs) expect_quoted({verb, "--help"});
}

TEST(Cli, DoctorSaysWhatIsMissing) {
  const Outcome outcome =
      orbitfuse_program({"doctor", "--json"}, {.environment = {"PATH=/nowhere"}});
  EXPECT_EQ(outcome.code, 6);
  bool colmap = false;
  const auto result = outcome.result();
  for (const auto& finding : result.at("findings"))
    if (finding.at("what") == "COLMAP") colmap = finding.at("remedy") != "";
  EXPECT_TRUE(colmap);
}

TEST(Cli, DoctorTellsABadFolderFromAMissingProgram) {
  const test::TempFolder temp;
  std::ofstream(temp.path() / "file") << "x";
  for (const std::string folder : {temp.path() / "none", temp.path() / "file"}) {
    const Outcome outcome = orbitfuse_program({"doctor", "--folder", folder});
    EXPECT_EQ(outcome.code, 3) << outcome.out;
    EXPECT_THAT(outcome.out, HasSubstr(folder));
  }
  EXPECT_EQ(orbitfuse_program({"doctor", "--folder", "/proc"}).code, 4);
}

TEST(Cli, NoColorAndNoBarWhenStderrIsAFile) {
  const Outcome outcome = orbitfuse_program({"inspect", "/does/not/exist"});
  EXPECT_EQ(outcome.code, 3);
  EXPECT_EQ(outcome.err.find('\033'), std::string::npos);
  EXPECT_EQ(outcome.out, "");
}

}  // namespace
}  // namespace orbitfuse
