// SPDX-License-Identifier: BSD-3-Clause
// --dry-run of what makes sessions says what the real command would say, and leaves nothing.
#include <fstream>

#include "core/image/image_io.hpp"
#include "core/session/session.hpp"
#include "tests/app/cli/refusal.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

const std::string tiny = "synthetic,size=64x48,spacing=60";

std::set<std::string> tree(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    names.insert(fs::relative(entry.path(), folder).string());
  return names;
}

class DryRun : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directory(temp.path() / "photos");
    for (const char* file : {"a.png", "b.png"}) {
      cv::Mat image(30, 40, CV_8UC3);
      cv::randu(image, 0, 255);
      ASSERT_TRUE(write_png(temp.path() / "photos" / file, image));
    }
    fs::create_directory(temp.path() / "empty");
    std::ofstream(temp.path() / "file") << "x";
    fs::create_symlink(temp.path() / "nowhere", temp.path() / "broken");
    ASSERT_EQ(orbitfuse_program({"import", done, "--visible", photos}).code, 0);
    before = tree(temp.path());
  }
  void TearDown() override { EXPECT_EQ(tree(temp.path()), before); }

  const test::TempFolder temp;
  const std::string done = temp.path() / "done", photos = temp.path() / "photos",
                    fresh = temp.path() / "new";
  std::set<std::string> before;
};

TEST_F(DryRun, FoldersThatNoSessionCanBeMadeIn) {
  struct Case {
    std::string folder;
    int code;
    std::string words;
  };
  const std::vector<Case> cases = {
      {done, 3, "holds a session already; choose another folder"},
      {photos, 3, "is not an empty folder"},
      {temp.path() / "file", 3, "is not a folder"},
      {temp.path() / "file" / "under", 3, "a part of the path is a file"},
      {temp.path() / std::string(300, 'x'), 2, "choose a shorter name"},
      {temp.path() / "made" / "on" / "the" / "way" / std::string(300, 'x'), 2,
       "choose a shorter name"},
      {temp.path() / "broken", 3, "a broken link"},
      {"/proc/orbitfuse", 4, "/proc/orbitfuse"},
  };
  for (const Case& c : cases) {
    expect_refused({"capture", c.folder, "--visible", tiny}, c.code, c.words);
    expect_refused({"import", c.folder, "--visible", photos}, c.code, c.words);
  }
  expect_refused({"replay", done, "--to", photos}, 3, "is not an empty folder");
  expect_refused({"capture", done, "--visible", tiny}, 3, "or go on with it: --resume");
  expect_refused({"capture", fresh, "--visible", tiny, "--resume"}, 3, "no such folder");
  expect_refused({"capture", photos, "--visible", tiny, "--resume"}, 3, photos);
}

TEST_F(DryRun, FoldersThatNoResultsCanBeWrittenTo) {
  const std::string file = temp.path() / "file";
  for (const std::string verb : {"run", "poses"}) {
    expect_refused({verb, done, "--out", file}, 3, "is no folder; choose another folder");
    expect_refused({verb, done, "--out", file + "/below"}, 3, "on its way is no folder");
    expect_refused({verb, done, "--out", temp.path() / "broken"}, 3, "a broken link");
    expect_refused({verb, done, "--out", "/proc/orbitfuse"}, 4, "/proc/orbitfuse");
  }
  expect_refused({"compare", done, photos, "--out", file}, 3, "is no folder");
  expect_refused({"export", done, "--to", file + "/a.ply"}, 3, "is no folder");
  expect_refused({"export", done, "--dataset", photos}, 2, "is there already");
  const std::vector<std::string> pair = {"fuse", "--visible", photos + "/a.png", "--thermal",
                                         photos + "/b.png"};
  for (const auto& [out, words] :
       {std::pair{file + "/f.png", "is no folder"}, {temp.path() / "f.png" / "", "end it in"}}) {
    std::vector<std::string> line = pair;
    line.insert(line.end(), {"--out", out});
    expect_refused(line, words[0] == 'e' ? 2 : 3, words);
  }
}

TEST_F(DryRun, CamerasAndGuides) {
  expect_refused({"capture", fresh, "--visible", "v4l2:/dev/video97"}, 4, "plug it in");
  expect_refused({"capture", fresh, "--visible", "stills:" + photos + "/none"}, 3, "none");
  expect_refused({"capture", fresh, "--visible", tiny, "--spacing-deg", "31"}, 2,
                 "guide.spacing_deg");
  expect_refused({"capture", fresh, "--visible", "aravis", "--profiles", photos + "/none"}, 3,
                 "no such folder");
  expect_refused({"capture", done, "--resume", "--visible", "stills:" + done + "/visible"}, 2,
                 "lies in the session that it is recorded into");
  expect_refused({"capture", done, "--force", "--visible", tiny}, 2, "never overwritten");
  expect_refused({"capture", fresh, "--visible", tiny, "--page", "somewhere"}, 2, "write PORT");
}

TEST_F(DryRun, PhotosThatCannotBeImported) {
  expect_refused({"import", fresh, "--visible", temp.path() / "none"}, 3, "No such file");
  expect_refused({"import", fresh, "--visible", temp.path() / "empty"}, 3, "no images");
  expect_refused({"import", fresh, "--visible", temp.path() / "file"}, 3, "file");
  expect_refused({"import", fresh, "--visible", photos, "--transforms", temp.path() / "file"}, 3,
                 "file");
}

TEST_F(DryRun, ImportOptionsWithoutEffect) {
  const auto refused = [&](std::vector<std::string> options, const std::string& words) {
    options.insert(options.begin(), {"import", fresh, "--visible", photos});
    expect_refused(options, 2, words);
  };
  refused({"--loops", "2"}, "--loops: given without --station-spacing-deg");
  refused({"--elevations-deg", "10"}, "--elevations-deg: given without --station-spacing-deg");
  refused({"--kelvin-per-count", "5"}, "--kelvin-per-count: given without --thermal-scale linear");
  refused({"--thermal-scale", "linear"}, "--thermal-scale: given without --thermal");
  refused({photos + "/a.png"}, "given twice");
  refused({""}, "--visible: empty");
}

TEST_F(DryRun, WayThroughAFolderThatIsMadeToo) {
  const std::string roundabout = temp.path() / "a" / ".." / "b" / "." / "c" / "";
  const Outcome dry = orbitfuse_program({"capture", roundabout, "--visible", tiny, "--dry-run"});
  EXPECT_EQ(dry.code, 0) << dry.err;
  EXPECT_EQ(tree(temp.path()), before);
  const Outcome real = orbitfuse_program({"capture", roundabout, "--visible", tiny});
  EXPECT_EQ(real.code, 0) << real.err;
  EXPECT_TRUE(open_session(temp.path() / "b" / "c"));
  fs::remove_all(temp.path() / "a");
  fs::remove_all(temp.path() / "b");
}

TEST_F(DryRun, SaysWhatImportWouldMake) {
  const Outcome dry =
      orbitfuse_program({"import", fresh, "--visible", photos, "--dry-run", "--json"});
  EXPECT_EQ(dry.code, 0) << dry.err;
  EXPECT_EQ(dry.result().at("visible"), 2);
  EXPECT_EQ(dry.result().at("dry_run"), true);
}

TEST_F(DryRun, WatchedFolderMayStillBeEmpty) {
  const Outcome dry = orbitfuse_program({"capture", fresh, "--visible",
                                         "stills:" + (temp.path() / "empty").string(), "--dry-run",
                                         "--seconds", "0.3"});
  EXPECT_EQ(dry.code, 0) << dry.err;
  EXPECT_THAT(dry.err, HasSubstr("no new photo came meanwhile"));
}

TEST_F(DryRun, WatchedPhotosHaveNoRateAndThoseIgnoredAreNamed) {
  const std::string camera = "stills:" + photos + ",existing=yes";
  const Outcome dry =
      orbitfuse_program({"capture", fresh, "--visible", camera, "--thermal", camera, "--dry-run"});
  EXPECT_EQ(dry.code, 0) << dry.err;
  EXPECT_THAT(dry.out, HasSubstr("2 frames of 40x30, 0 rejected"));
  EXPECT_THAT(dry.err, HasSubstr("thermal0: ignored (2 times), last b.png: no temperatures in it"));
}

/// What an import refuses to do must not be its own remedy.
TEST_F(DryRun, ImportDoesNotSendToResume) {
  const Outcome again = orbitfuse_program({"import", done, "--visible", photos});
  EXPECT_EQ(again.code, 3);
  EXPECT_THAT(again.err, Not(HasSubstr("--resume")));
  expect_refused({"import", done, "--visible", photos, "--resume"}, 2,
                 "orbitfuse capture SESSION --resume");
  expect_refused({"import", done, "--visible", photos, "--force"}, 2, "never overwritten");
}

}  // namespace
}  // namespace orbitfuse
