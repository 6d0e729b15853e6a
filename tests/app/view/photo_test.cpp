// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/photo.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "core/image/image_io.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::view {
namespace {

/// Kelvin, or the level, of one pixel of a photo's only part.
double value_at(const std::string& body, int x, int y) {
  std::uint32_t length = 0;
  std::memcpy(&length, body.data(), 4);
  const auto part = nlohmann::json::parse(body.substr(4, length)).at("parts").at(0);
  const std::size_t pixel = static_cast<std::size_t>(y * part.at("width").get<int>() + x);
  std::uint16_t count = 0;
  std::memcpy(&count, body.data() + 4 + length + 2 * pixel, 2);
  return count * part.at("scale").get<double>() + part.at("offset").get<double>();
}

/// A run of one thermal view of 64x48 pixels, whose frame is "a" with this extension.
FinishedRun run_of_one_view(const orbitfuse::test::TempFolder& folder, const char* extension) {
  FinishedRun run;
  run.session.emplace().folder = folder.path();
  FrameRecord& frame = run.session->frames.emplace_back();
  frame.modality = Modality::thermal;
  frame.file = std::string("a") + extension;
  RecordedView view{Modality::thermal, {}, {}};
  view.view.name = frame.file;
  view.view.camera = Camera{64, 48, 60, 60, 32, 24};
  run.views.push_back(view);
  return run;
}

// It lies beside a render of a field that is without its lens' shading, and measurements read it
// so.
TEST(Photo, ThermalOneIsWithoutItsLensShading) {
  const orbitfuse::test::TempFolder folder;
  FinishedRun run = run_of_one_view(folder, ".tiff");
  run.shading_k = -2;
  ASSERT_TRUE(write_thermal_tiff(
      folder / "a.tiff",
      cv::Mat(cv::Mat(48, 64, CV_32FC1, cv::Scalar(300)) + nerf::shading_image(-2, {64, 48})),
      0.01));
  const auto shown = photo(run, 0);
  ASSERT_TRUE(shown) << shown.error().message();
  for (const int x : {0, 32, 63}) EXPECT_NEAR(value_at(*shown, x, 0), 300, 0.05) << x;
}

TEST(Photo, GrayOneHasTheLevelsThatTheFieldLearned) {
  const orbitfuse::test::TempFolder folder;
  FinishedRun run = run_of_one_view(folder, ".png");
  run.thermal_is_gray = true;
  ASSERT_TRUE(write_png(folder / "a.png", cv::Mat(48, 64, CV_8UC1, cv::Scalar(100))));
  const auto level = [&] {
    const auto shown = photo(run, 0);
    EXPECT_TRUE(shown) << shown.error().message();
    return value_at(*shown, 32, 24);
  };
  const double stored = level();
  run.gray_curves["a.png"] = {0, 16, 32, 48, 64, 80, 96, 112, 127.5};
  EXPECT_NEAR(level(), stored / 2, stored / 100);
}

}  // namespace
}  // namespace orbitfuse::view
