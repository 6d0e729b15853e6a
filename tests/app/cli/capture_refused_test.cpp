// SPDX-License-Identifier: BSD-3-Clause
// What `orbitfuse capture` says, and with which exit code, when a camera, a port or a folder is not
// to be had; nothing is left behind.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <thread>

#include "core/image/image_io.hpp"
#include "drivers/aravis/aravis_source.hpp"
#include "tests/app/cli/refusal.hpp"
#include "tests/support/gev_simulator.hpp"
#include "tests/support/slow_peers.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const std::string tiny = "synthetic,size=64x48,spacing=60";

/// With a simulated GigE camera at the loopback address.
class RefusedGigE : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!camera.start_when_free()) GTEST_SKIP() << "the GVCP port 3956 on loopback is in use";
  }
  testing::GevSimulator camera;
  const test::TempFolder temp;
  const std::string session = temp.path() / "s";
};

TEST_F(RefusedGigE, ProfileWithAFeatureThatTheCameraLacks) {
  // TemperatureLinearMode is of another family than the simulated camera.
  const Outcome outcome = orbitfuse_program(
      {"capture", session, "--thermal", "aravis:127.0.0.1,profile=flir-ax5", "--seconds", "1"});
  EXPECT_EQ(outcome.code, 4) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("flir-ax5"));
  EXPECT_FALSE(std::filesystem::exists(session));
}

TEST_F(RefusedGigE, UnknownFeatureInAProfileOfTheUser) {
  std::filesystem::create_directory(temp.path() / "profiles");
  std::ofstream(temp.path() / "profiles/mine.toml")
      << "name = \"mine\"\nmodels = []\nsettings = [{NoSuchThing = 3}]\n";
  const Outcome outcome =
      orbitfuse_program({"capture", session, "--thermal", "aravis:127.0.0.1,profile=mine",
                         "--profiles", temp.path() / "profiles", "--seconds", "1"});
  EXPECT_EQ(outcome.code, 2) << outcome.err;
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("NoSuchThing"), HasSubstr("correct the profile")));
  EXPECT_FALSE(std::filesystem::exists(session));
}

TEST_F(RefusedGigE, DoctorSaysThatTheCameraIsFree) {
  const Outcome outcome = orbitfuse_program({"doctor", "--folder", temp.path()});
  EXPECT_THAT(outcome.out, HasSubstr("at 127.0.0.1, packets of 1400 bytes"));
}

TEST_F(RefusedGigE, WatchedDevicesAreToldWhenTheyArrive) {
  camera.kill();
  std::jthread plug([this] {
    std::this_thread::sleep_for(std::chrono::seconds(3));
    EXPECT_TRUE(camera.start());
  });
  RunOptions until;
  until.interrupt_after = "+ aravis:";
  const Outcome outcome = orbitfuse_program({"devices", "--watch"}, until);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("SIM0001"));
}

TEST_F(RefusedGigE, CameraThatAnotherProgramControls) {
  aravis::AravisOptions options;
  options.camera = "127.0.0.1";
  options.profiles = std::filesystem::path(ORBITFUSE_SOURCE_DIR) / "config/cameras";
  aravis::AravisSource first(options);
  ASSERT_TRUE(first.start());
  const Outcome outcome =
      orbitfuse_program({"capture", session, "--thermal", "aravis:127.0.0.1", "--seconds", "1"});
  EXPECT_EQ(outcome.code, 4) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("another program"));
  EXPECT_FALSE(std::filesystem::exists(session));
  // The one that has it goes on.
  int frames = 0;
  for (int i = 0; i < 100 && frames < 10; ++i) {
    const auto delivery = first.next(std::chrono::milliseconds(200));
    ASSERT_TRUE(delivery);
    frames += delivery->kind == Delivery::Kind::frame;
  }
  EXPECT_EQ(frames, 10);
}

TEST(Refused, PageAtAPortInUse) {
  const test::TempFolder temp;
  const test::SilentListener holder;
  ASSERT_NE(holder.port(), 0);
  const std::string port = std::to_string(holder.port());
  expect_refused({"capture", temp.path() / "s", "--visible", tiny, "--page", port}, 4, port);
  expect_refused({"capture", temp.path() / "s", "--visible", tiny, "--page", port}, 4,
                 "choose another with --page");
  EXPECT_FALSE(std::filesystem::exists(temp.path() / "s"));
}

/// Without root's rights, also when the tests have them.
Outcome as_nobody(const std::vector<std::string>& arguments) {
  std::vector<std::string> command{ORBITFUSE_BINARY_DIR "/app/orbitfuse"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  if (::geteuid() == 0) {
    const std::vector<std::string> drop{"setpriv", "--reuid=65534", "--regid=65534",
                                        "--clear-groups"};
    command.insert(command.begin(), drop.begin(), drop.end());
  }
  return run_program(command);
}

TEST(Refused, DeviceAndFolderWithoutPermission) {
  const test::TempFolder temp;
  std::filesystem::permissions(
      temp.path(), std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec |
                       std::filesystem::perms::others_read | std::filesystem::perms::others_exec);
  const std::string session = temp.path() / "s";
  if (as_nobody({"--version"}).code != 0)
    GTEST_SKIP() << "setpriv, or the program for other users, is missing";
  expect_refused({"capture", session, "--visible", tiny}, 4, session + ": Permission denied",
                 as_nobody);
  // Any device that only root may open stands for a camera.
  if (std::filesystem::exists("/dev/loop-control")) {
    const test::TempFolder open_to_all;
    std::filesystem::permissions(open_to_all.path(), std::filesystem::perms::all);
    const std::string never = open_to_all.path() / "never";
    const Outcome device =
        as_nobody({"capture", never, "--visible", "v4l2:/dev/loop-control", "--seconds", "1"});
    EXPECT_EQ(device.code, 4) << device.err;
    EXPECT_THAT(device.err, HasSubstr("group video"));
    EXPECT_FALSE(std::filesystem::exists(never));
  }
  EXPECT_FALSE(std::filesystem::exists(session));
  std::filesystem::permissions(temp.path(), std::filesystem::perms::owner_all);
}

TEST(Refused, SessionThatMayNotBeRead) {
  const test::TempFolder temp;
  std::ofstream(temp.path() / "manifest.jsonl") << "x";
  std::filesystem::permissions(temp.path(), std::filesystem::perms::none);
  if (as_nobody({"--version"}).code != 0)
    GTEST_SKIP() << "setpriv, or the program for other users, is missing";
  const Outcome outcome = as_nobody({"inspect", temp.path()});
  std::filesystem::permissions(temp.path(), std::filesystem::perms::owner_all);
  EXPECT_EQ(outcome.code, 3) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("Permission denied"));
}

/// On a disk of 16 MiB.
TEST(Refused, DiskWithTooLittleSpace) {
  const test::TempFolder temp;
  const std::string disk = temp.path(), session = temp.path() / "a" / "s";
  const std::string photo = temp.path().string() + "-photo.png";
  ASSERT_TRUE(write_png(photo, cv::Mat(30, 40, CV_8UC3, cv::Scalar(9, 80, 7))));
  const Runner run = [&](const std::vector<std::string>& arguments) {
    std::string line = "mount -t tmpfs -o size=16m none '" + disk +
                       "' && '" ORBITFUSE_BINARY_DIR "/app/orbitfuse'";
    for (const std::string& word : arguments) line += " '" + word + "'";
    line += "; code=$?; [ -z \"$(ls -A '" + disk + "')\" ] && exit $code || exit 99";
    return run_program({"unshare", "--map-root-user", "--mount", "sh", "-c", line});
  };
  if (run({"--version"}).code != 0)
    GTEST_SKIP() << "no disk of its own can be mounted here (unshare)";
  const std::string words = "16 MiB free on the disk, 64 MiB needed; free disk space, or ";
  expect_refused({"capture", session, "--visible", tiny}, 4, words + "record to another disk", run);
  expect_refused({"import", session, "--visible", photo}, 4, words + "import to another disk", run);
  std::filesystem::remove(photo);
}

}  // namespace
}  // namespace orbitfuse
