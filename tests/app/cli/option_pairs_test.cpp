// SPDX-License-Identifier: BSD-3-Clause
// Options that mean nothing beside the others are not passed over in silence.
#include "core/system/file_io.hpp"
#include "tests/app/cli/refusal.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

struct Case {
  std::vector<std::string> words;
  std::string said;
};

void expect_all_refused(std::vector<std::string> verb, const std::vector<Case>& cases) {
  for (const auto& [words, said] : cases) {
    std::vector<std::string> line = verb;
    line.insert(line.end(), words.begin(), words.end());
    SCOPED_TRACE(testing::PrintToString(line));
    expect_refused(line, 2, said);
  }
}

TEST(OptionPairs, Measure) {
  expect_all_refused(
      {"measure", "run"},
      {{{"--point", "0,0,0", "--apart", "1"}, "--apart: given without --hottest or --coldest"},
       {{"--hottest", "3", "--profile", "9"}, "--profile: given without --line"},
       {{"--distance", "a", "b", "--emissivity", "1"}, "--emissivity: given with --distance"},
       {{"--air-c", "20"}, "--air-c: given without a measurement such as --point"},
       {{"--name", "a"}, "--name: given without a measurement"},
       {{"--save"}, "--save: given without a measurement"},
       {{"--hottest", "1", "--component", "a"}, "--component: given without --save"}});
}

TEST(OptionPairs, Import) {
  expect_all_refused(
      {"import", "session", "--visible", "photos"},
      {{{"--priors-only"}, "--priors-only: given without --ground-truth"},
       {{"--embedded-visible"}, "--embedded-visible: given without --thermal"},
       {{"--thermal-focal-px", "600"}, "--thermal-focal-px: given without --thermal"},
       {{"--thermal-colmap", "model"}, "--thermal-colmap: given without --thermal"},
       {{"--rig"}, "--rig: given without --visible and --thermal"}});
  expect_all_refused(
      {"import", "session", "--thermal", "photos"},
      {{{"--visible-focal-px", "600"}, "--visible-focal-px: given without --visible"},
       {{"--video-frames", "9"}, "--video-frames: given without --visible"}});
}

TEST(OptionPairs, Export) {
  expect_all_refused(
      {"export", "run"},
      {{{"--palette", "inferno"}, "--palette: given without --colors temperature"},
       {{"--points"}, "--points: given without a PLY file"},
       {{"--to", "a.glb", "--flavour", "meshlab"}, "--flavour: given without a PLY file"},
       {{"--poses", "new"}, "--poses: given without --dataset"},
       {{"--dataset", "pairs", "--whole"}, "--whole: given without --to beside --dataset"},
       {{"--dataset", "pairs", "--triangles", "9"},
        "--triangles: given without --to beside --dataset"},
       {{"--to", "a.glb", "--to", "./a.glb"}, "--to: './a.glb' twice"},
       {{"--to", "pairs/a.glb", "--dataset", "pairs"},
        "--to: 'pairs/a.glb', inside of the new folder of --dataset"},
       {{"--whole", "--crop-box", "0,0,0,1,1,1"}, "--whole: given with --crop-box"},
       {{"--mat-tags", "5"}, "--mat-tags: given without --mat"}});
}

TEST(OptionPairs, ExportRepeatsTheValueThatIsNone) {
  expect_all_refused(
      {"export", "run"},
      {{{"--crop-box", "0,0,0,-1,1,1"}, "--crop-box: '0,0,0,-1,1,1', with a side of 0 or less"},
       {{"--up", "0,0,0"}, "--up: '0,0,0', which is no direction"},
       {{"--triangles", "0"}, "--triangles: 0"}});
}

TEST(OptionPairs, VerbsOfASessionOrOfFiles) {
  expect_all_refused({"fuse", "session"}, {{{"--method", "best"}, "--method: given without"},
                                           {{"--mask", "m.png"}, "--mask: given without"}});
  expect_all_refused({"fuse", "--visible", ".", "--thermal", "."},
                     {{{"--mask", "m.png"}, "--mask: given with folders of images"},
                      {{"session"}, "session: given with --visible"}});
  expect_all_refused({"register", "--source", "a.ply", "--target", "b.ply"},
                     {{{"session"}, "session: given with --source"},
                      {{"--out", "o"}, "--out: given with --source"}});
  expect_all_refused({"metrics", "--visible", "v", "--thermal", "t", "--fused", "f"},
                     {{{"session"}, "session: given with --visible"},
                      {{"--out", "o"}, "--out: given with --visible"}});
  expect_all_refused({"report", "--print-template"},
                     {{{"--inspection", "a.toml"}, "--inspection: given with --print-template"},
                      {{"--pdf"}, "--pdf: given with --print-template"}});
}

TEST(OptionPairs, RunsRendersAndCameras) {
  expect_all_refused(
      {"run", "session"},
      {{{"--cameras", "c.json", "--stage", "depth"}, "--cameras: given with"},
       {{"--target-psnr", "20", "--stage", "poses_visible"}, "--target-psnr: given with"}});
  expect_all_refused({"render", "session", "--cameras", "c.json"},
                     {{{"--path", "orbit"}, "--path: given with --cameras"},
                      {{"--views", "9"}, "--views: given with --cameras"},
                      {{"--width", "99"}, "--width: given with --cameras"}});
  expect_all_refused({"capture", "session", "--visible", "synthetic"},
                     {{{"--profiles", "."}, "--profiles: given without a camera of aravis"}});
}

/// What every verb was offered once, and most passed over.
TEST(OptionPairs, CommonOptionsOfOtherVerbs) {
  const std::vector<std::vector<std::string>> no_stages = {
      {"inspect", "x"}, {"view", "x"},   {"measure", "x"},     {"eval", "x"},
      {"devices"},      {"farm", "x"},   {"doctor"},           {"import", "x"},
      {"capture", "x"}, {"replay", "x"}, {"compare", "x", "y"}};
  for (const auto& verb : no_stages) expect_all_refused(verb, {{{"--force"}, "--force: "}});
  for (const char* verb : {"measure", "eval", "view"})
    expect_all_refused({verb},
                       {{{"--resume"}, std::string("--resume: means nothing to ") + verb},
                        {{"--seed", "7"}, std::string("--seed: means nothing to ") + verb}});
  for (const char* verb : {"inspect", "measure", "import"})
    expect_all_refused(
        {verb}, {{{"--set", "render.views=3"}, std::string("--set: means nothing to ") + verb},
                 {{"--config=a.toml"}, std::string("--config: means nothing to ") + verb}});
  expect_all_refused({"run", "x"}, {{{"-q", "-v"}, "excludes"}});
}

TEST(OptionPairs, HelpOffersNoCommonOptionThatMeansNothing) {
  for (const char* verb : {"inspect", "measure", "doctor", "import"}) {
    const std::string help = orbitfuse_program({verb, "--help"}).out;
    for (const char* option : {"--force", "--seed", "--config", "--set", "--print-config"})
      EXPECT_EQ(help.find(std::string(option) + " "), std::string::npos) << verb << " " << option;
  }
  for (const char* verb : {"run", "poses", "train", "register", "render", "fuse", "metrics"}) {
    const std::string help = orbitfuse_program({verb, "--help"}).out;
    for (const char* option : {"--force", "--resume", "--seed", "--config"})
      EXPECT_NE(help.find(option), std::string::npos) << verb << " " << option;
  }
}

TEST(OptionPairs, OptionsOfStagesBesideFiles) {
  expect_all_refused({"fuse", "--visible", "a", "--thermal", "b"},
                     {{{"--force"}, "--force: given with --visible and --thermal"},
                      {{"--seed", "2"}, "--seed: given with --visible and --thermal"}});
  expect_all_refused({"metrics", "--visible", "v", "--thermal", "t", "--fused", "f"},
                     {{{"--resume"}, "--resume: given with --visible"},
                      {{"--set", "render.views=3"}, "--set: given with --visible"}});
  expect_all_refused({"register", "--source", "a.ply", "--target", "b.ply"},
                     {{{"--force"}, "--force: given with --source"}});
  expect_all_refused({"report", "--print-template"},
                     {{{"--force"}, "--force: given with --print-template"}});
  expect_all_refused({"report", "x", "--inspection", "a.toml"},
                     {{{"--resume"}, "--resume: given with --inspection"}});
}

TEST(OptionPairs, Farm) {
  expect_all_refused({"farm", "session"},
                     {{{"--account", "a"}, "--account: given without --slurm"},
                      {{"--slurm", "--workers", "2"}, "--workers: given with --slurm"}});
  for (const char* order : {"status", "resume", "cancel"})
    expect_all_refused({"farm", order, "."},
                       {{{"--tries", "2"}, std::string("--tries: given with farm ") + order},
                        {{"--seed", "2"}, std::string("--seed: given with farm ") + order}});
  expect_all_refused({"farm", "status", "."},
                     {{{"--cores", "2"}, "--cores: given with farm status"}});
}

}  // namespace
}  // namespace orbitfuse
