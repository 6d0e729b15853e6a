// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <string>

#include "core/image/image_codec.hpp"
#include "core/image/image_io.hpp"
#include "drivers/stills/import.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {

/// Files in a folder of the test's own, and their import into its folder session/.
class ImportFiles : public ::testing::Test {
 protected:
  void put(const std::string& name, const std::string& bytes) const {
    test::put(folder / name, bytes);
  }
  /// A picture of its own for each seed: copies are left out.
  void put_photo(const std::string& name, std::uint64_t seed) const {
    cv::Mat image(30, 40, CV_8UC3);
    cv::RNG(seed + 1).fill(image, cv::RNG::UNIFORM, 0, 255);
    put(name, *encode_jpeg(image, 90));
  }
  Result<ImportReport> import() const { return import_session(options, folder / "session"); }
  cv::Mat kelvin_of(const ImportReport& report, std::size_t frame) const {
    return *read_thermal_k(report.session.path_of(report.session.frames.at(frame)));
  }

  test::TempFolder folder;
  ImportOptions options;
};

}  // namespace orbitfuse
