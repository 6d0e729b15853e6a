// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/radiometry/flir_temperature.hpp"
#include "core/result.hpp"

namespace orbitfuse {

/// What a FLIR radiometric JPEG holds.
struct FlirImage {
  cv::Mat signal;  ///< CV_16UC1, raw sensor counts
  /// Signals in between are what the camera was calibrated for; at an end, and beyond, they mean
  /// "that or less" and "that or more". The camera's own range, or all counts where it names none
  /// that the image fits.
  int lowest_signal = 0, highest_signal = 65535;
  FlirCalibration calibration;
  std::string camera_model, camera_serial;
  std::optional<double> horizontal_fov_deg;
  std::optional<std::int64_t> taken_ns;  ///< UTC
  int utc_offset_s = 0;                  ///< the camera's local time less UTC
  std::string embedded_visible;          ///< JPEG or PNG file, empty if absent
};

/// True when the JPEG carries FLIR segments (then read_flir_jpeg says what is in them).
bool is_flir_jpeg(std::string_view bytes);

/// Reads the FLIR file inside the JPEG's APP1 segments (layout as published by the ExifTool
/// project). Any damage is an input error: every offset and length is checked. `where` names the
/// file in errors. Constants are as the file has them: call calibration.validate() before
/// FlirThermometer.
Result<FlirImage> read_flir_jpeg(std::string_view bytes, const std::string& where);

/// A file that begins with a FLIR header: one image (FFF) or a recording (SEQ, and CSQ, which keeps
/// its samples as JPEG-LS): such files one behind the other.
bool is_flir_recording(std::string_view bytes);
/// Its images, in order. A damaged one is among them as what is left of it, which read_flir_file()
/// refuses.
std::vector<std::string_view> flir_recording_frames(std::string_view bytes);
/// One of them. `where`, errors and constants as of read_flir_jpeg.
Result<FlirImage> read_flir_file(std::string_view file, const std::string& where);

}  // namespace orbitfuse
