// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/aravis/profile.hpp"

#include <gtest/gtest.h>

#include <fstream>

namespace orbitfuse::aravis {
namespace {

namespace fs = std::filesystem;

const fs::path shipped = fs::path(ORBITFUSE_SOURCE_DIR) / "config/cameras";

TEST(CameraProfile, ShippedProfilesMatchTheirModels) {
  EXPECT_EQ(find_profile(shipped, "FLIR A70 (simulated)")->name, "flir-axx");
  EXPECT_EQ(find_profile(shipped, "FLIR A65")->name, "flir-ax5");
  EXPECT_EQ(find_profile(shipped, "Blackfly")->name, "generic");
  EXPECT_EQ(read_profile(shipped / "flir-radiometric.toml")->scale, SampleScale::radiometric);
}

TEST(CameraProfile, SettingsKeepTheirOrder) {
  const auto profile = read_profile(shipped / "flir-ax5.toml");
  ASSERT_TRUE(profile);
  ASSERT_EQ(profile->settings.size(), 3u);
  EXPECT_EQ(profile->settings[0].first, "PixelFormat");
  EXPECT_EQ(std::get<std::string>(profile->settings[1].second), "On");
}

TEST(CameraProfile, BadFilesAreNamed) {
  const fs::path file = fs::path(testing::TempDir()) / "profile.toml";
  for (const char* content : {"nonsense = 1", "scale = \"cubic\"", "scale = \"linear\"",
                              "settings = [1]", "name = [", "settings = [{A = 1, B = 2}]"}) {
    std::ofstream(file) << content;
    const auto profile = read_profile(file);
    ASSERT_FALSE(profile) << content;
    EXPECT_NE(profile.error().where.find("profile.toml"), std::string::npos);
  }
  EXPECT_FALSE(read_profile(file.parent_path() / "absent.toml"));
  EXPECT_FALSE(find_profile(file.parent_path() / "absent", "x"));
}

}  // namespace
}  // namespace orbitfuse::aravis
