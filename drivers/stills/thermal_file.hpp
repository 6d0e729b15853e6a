// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/image/image_codec.hpp"
#include "core/result.hpp"
#include "drivers/stills/dji_jpeg.hpp"
#include "drivers/stills/flir_jpeg.hpp"
#include "drivers/stills/float_temperatures.hpp"

namespace orbitfuse {

/// One thermal file, before the session-wide decision what its samples mean.
struct ThermalFile {
  enum class Kind {
    radiometric_jpeg,
    samples16,
    floats,
    gray8
  };  ///< the first: any image of a FLIR camera
  Kind kind = Kind::gray8;
  std::string bytes;  ///< gray8: the file, or its image turned upright
  std::optional<std::int64_t> taken_ns;
  std::optional<std::int64_t> utc_offset_s;  ///< of that time, where the file tells it
  cv::Mat image;  ///< samples16: CV_16UC1; floats: CV_32FC1; gray8: CV_8U
  std::optional<FlirImage> flir;
  std::optional<DjiImage> dji;         ///< samples16: never temperatures unless the user says how
  std::optional<ThermalScaleTag> tag;  ///< from the file or its sidecar
  std::string two_scales;              ///< what to say where these two differ
  double transparent = 0;              ///< as of StillPhoto
  std::string other_pages;             ///< likewise; of the first page
  /// As EXIF had it; samples and image here are turned upright by it.
  int orientation = 1;
  bool lies_across = false;  ///< upright beside a broad picture, or the reverse: EXIF can't tell
  std::optional<FloatUnit> unit;  ///< of floats without a tag, where the file or sidecar names it
};

/// Of a row or a dot of pixels no frame can be made. Input error.
Status check_frame_size(cv::Size size, const std::string& where);

/// Without a page the file must hold a single image.
Result<ThermalFile> read_thermal_file(const std::filesystem::path& file,
                                      std::optional<int> page = {});
/// The same of bytes that were read from `file`. Whoever reads all pages of a recording gives its
/// flir_recording_frames() too: finding them takes a pass over the file.
Result<ThermalFile> thermal_file(std::string_view bytes, const std::filesystem::path& file,
                                 std::optional<int> page = {},
                                 const std::vector<std::string_view>* known_frames = nullptr);
/// Images in the bytes: pages of a TIFF, frames of a FLIR recording; at least 1.
int thermal_page_count(std::string_view bytes);

}  // namespace orbitfuse
