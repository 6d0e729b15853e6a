// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/image/image_codec.hpp"
#include "core/result.hpp"
#include "drivers/stills/flir_jpeg.hpp"
#include "drivers/stills/import.hpp"

namespace orbitfuse {

/// One thermal file, before the session-wide decision what its samples mean.
struct ThermalFile {
  enum class Kind { radiometric_jpeg, samples16, gray8 };
  Kind kind = Kind::gray8;
  std::string bytes;
  cv::Mat image;                      ///< samples16: CV_16UC1; gray8: CV_8U
  std::optional<FlirImage> flir;
  std::optional<ThermalScaleTag> tag; ///< from the file or its sidecar
};

Result<ThermalFile> read_thermal_file(const std::filesystem::path& file);

/// What 16-bit samples without a tag mean, decided once for all files, so that a session never
/// mixes meanings: first every file is observed, then each is converted.
class ThermalDecoder {
 public:
  explicit ThermalDecoder(const ImportOptions& options) : options_(options) {}
  void observe(const ThermalFile& file);
  /// After all observations.
  bool samples_are_raw_counts() const;

  struct Converted {
    cv::Mat centikelvin;   ///< empty for grey
    cv::Mat gray;          ///< raw counts under one stretch for the session
    bool keep_bytes = false;  ///< 8-bit file: copy it
  };
  Result<Converted> convert(const ThermalFile& file, const std::string& where) const;

 private:
  double percentile(double percent) const;
  const ImportOptions& options_;
  std::vector<std::uint64_t> histogram_ = std::vector<std::uint64_t>(65536);
  std::uint64_t untagged_ = 0;
};

}  // namespace orbitfuse
