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

  /// The photos of "in" once more, of a place that the poses' file doesn't name.
  Result<ImportReport> import_from_elsewhere() {
    std::filesystem::rename(folder / "in", folder / "elsewhere");
    std::filesystem::remove_all(folder / "session");
    options.visible = {folder / "elsewhere"};
    return import();
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
  // Found by name, where the images lie elsewhere.
  const auto by_name = import_from_elsewhere();
  ASSERT_TRUE(by_name) << by_name.error().message();
  EXPECT_EQ(by_name->with_pose, 2);
  EXPECT_THAT(by_name->warnings, test::one_says("1.jpg has two different poses"));
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
  const auto by_name = import_from_elsewhere();
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

TEST_F(KnownPoses, FramesOfThermalImagesGivenAsSuchAreThermal) {
  put_photo("in/0.jpg", 0);
  put_photo("in/1.jpg", 1);
  std::filesystem::create_directory(folder / "flir");
  for (int i = 0; i < 2; ++i) {
    cv::Mat kelvin(30, 40, CV_32F);
    cv::RNG(static_cast<std::uint64_t>(i + 7)).fill(kelvin, cv::RNG::UNIFORM, 290, 310);
    ASSERT_TRUE(write_thermal_tiff(folder / "flir" / (std::to_string(i) + ".tiff"), kelvin));
  }
  put_transforms({"in/0.jpg", "flir/0.tiff", "in/1.jpg", "flir/1.tiff"}, 1);
  options.thermal = {folder / "flir"};
  for (const bool photos_given : {false, true}) {
    if (photos_given) options.visible = {folder / "in"};
    std::filesystem::remove_all(folder / "session");
    const auto report = import();
    ASSERT_TRUE(report) << report.error().message();
    EXPECT_EQ(report->visible, 2);
    EXPECT_EQ(report->thermal, 2);
    EXPECT_EQ(report->with_pose, 4);
    EXPECT_THAT(report->warnings,
                test::one_says("transforms.json: 2 of 4 frames are thermal images"));
    for (const FrameRecord& frame : report->session.frames) {
      ASSERT_TRUE(frame.cam_from_world);
      const double place = frame.cam_from_world->translation.x();
      EXPECT_EQ(place == 1 || place == 3, frame.modality == Modality::thermal) << frame.file;
    }
  }
}

}  // namespace
}  // namespace orbitfuse
