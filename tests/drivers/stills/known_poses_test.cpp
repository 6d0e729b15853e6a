// SPDX-License-Identifier: BSD-3-Clause
// Poses that contradict each other, and what else files of poses hold, are not passed over.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/formats/transforms_json.hpp"
#include "core/system/file_io.hpp"
#include "drivers/stills/import.hpp"
#include "tests/drivers/stills/import_files.hpp"
#include "tests/support/says.hpp"

namespace orbitfuse {
namespace {

class KnownPoses : public ImportFiles {
 protected:
  void put_transforms(const std::vector<std::string>& files, double moved) {
    Transforms transforms;
    for (std::size_t i = 0; i < files.size(); ++i) {
      const Rigid3d pose{Eigen::Quaterniond::Identity(), {moved * static_cast<double>(i), 0, 0}};
      transforms.frames.push_back({files[i], {}, Camera::from_fov(40, 30, 50), pose});
    }
    ASSERT_TRUE(write_transforms_json(folder / "transforms.json", transforms));
    options.transforms_json = folder / "transforms.json";
  }
};

TEST_F(KnownPoses, AnImageWithTwoDifferentPosesHasNoneAndIsNamed) {
  for (int i = 0; i < 3; ++i)
    put_photo("in/" + std::to_string(i) + ".jpg", static_cast<std::uint64_t>(i));
  put_transforms({"in/0.jpg", "in/1.jpg", "in/2.jpg", "in/1.jpg"}, 1);
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->visible, 3);
  EXPECT_EQ(report->with_pose, 2);
  EXPECT_THAT(report->warnings, test::one_says("1.jpg has two different poses"));
  EXPECT_THAT(report->warnings, test::none_says("the same image as"));
}

TEST_F(KnownPoses, AnImageThatIsThereTwiceWithOnePoseIsOneFrame) {
  put_photo("in/0.jpg", 0);
  put_photo("in/1.jpg", 1);
  put_transforms({"in/0.jpg", "in/1.jpg", "in/./1.jpg"}, 0);
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->visible, 2);
  EXPECT_EQ(report->with_pose, 2);
  EXPECT_THAT(report->warnings, test::none_says("the same image as"));
  // Found by name too, where the images lie elsewhere.
  std::filesystem::rename(folder / "in", folder / "elsewhere");
  std::filesystem::remove_all(folder / "session");
  options.visible = {folder / "elsewhere"};
  const auto by_name = import();
  ASSERT_TRUE(by_name) << by_name.error().message();
  EXPECT_EQ(by_name->with_pose, 2);
}

TEST_F(KnownPoses, MasksAndDepthsThatNothingUsesAreTold) {
  put_photo("in/0.jpg", 0);
  put_photo("in/1.jpg", 1);
  put_transforms({"in/0.jpg", "in/1.jpg"}, 1);
  std::string text = read_file(folder / "transforms.json").value();
  const std::string name = "\"file_path\"";
  text.insert(text.find(name), "\"mask_path\": \"masks/0.png\", ");
  put("transforms.json", text);
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->with_pose, 2);
  EXPECT_THAT(report->warnings,
              test::one_says("transforms.json: mask_path is there in 1 of 2 frames"));
  EXPECT_THAT(report->warnings, test::none_says("depth_file_path"));
}

}  // namespace
}  // namespace orbitfuse
