// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "core/image/image_io.hpp"
#include "core/system/file_io.hpp"
#include "drivers/stills/flir_jpeg.hpp"
#include "drivers/stills/import.hpp"
#include "recon/measurement/reradiometry.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::measurement {
namespace {

ThermalFrame frame(std::optional<FlirCalibration> radiometry) {
  return {{"thermal/000000.tiff", {}, {}}, {}, radiometry};
}

TEST(Reradiometry, OfAnImportedFileIsWithin50MillikelvinOfItsRawCounts) {
  const std::filesystem::path sample =
      orbitfuse::testing::shared_data() / "rjpeg/irimage_test/test_image.jpg";
  if (!std::filesystem::exists(sample)) GTEST_SKIP() << "the shared radiometric JPEGs are not here";
  const test::TempFolder temp;
  ImportOptions options;
  options.thermal = {sample};
  const auto report = import_session(options, temp / "session");
  ASSERT_TRUE(report) << report.error().message();
  const auto session = open_session(temp / "session");
  ASSERT_TRUE(session) << session.error().message();
  const FrameRecord& record = session->frames.at(0);
  ASSERT_TRUE(record.radiometry) << "the manifest keeps what the temperatures were made with";
  const auto stored = read_thermal_k(session->path_of(record));
  const auto raw = read_flir_jpeg(*read_file(sample), "sample");
  ASSERT_TRUE(stored);
  ASSERT_TRUE(raw);
  EXPECT_EQ(*record.radiometry, raw->calibration);
  ObjectParameterOverrides others[3];  // emissivity, distance, reflected, air, humidity
  others[0].emissivity = 0.6, others[0].reflected_temperature_k = 268.15;
  others[1] = {0.95, 5.0, 280.15, 293.15, 0.5};
  others[2] = {0.8, 50.0, 300.15, 303.15, 0.9};
  for (const ObjectParameterOverrides& other : others) {
    const auto change = Reradiometry::make({frame(record.radiometry)}, other, {});
    ASSERT_TRUE(change) << change.error().message();
    FlirCalibration calibration = raw->calibration;
    calibration.object = with_overrides(calibration.object, other);
    const FlirThermometer direct(calibration);
    double worst = 0;
    for (int y = 0; y < stored->rows; ++y)
      for (int x = 0; x < stored->cols; ++x) {
        const double now = change->frame_k(0, static_cast<double>(stored->at<float>(y, x)));
        const double expected = direct.kelvin(raw->signal.at<std::uint16_t>(y, x));
        ASSERT_EQ(std::isfinite(now), std::isfinite(expected));
        worst = std::max(worst, std::abs(now - expected));
      }
    EXPECT_LT(worst, 0.05);
  }
}

}  // namespace
}  // namespace orbitfuse::measurement
