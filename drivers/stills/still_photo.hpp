// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>

#include "capture/frame_source.hpp"
#include "core/image/exif.hpp"
#include "drivers/stills/thermal_decoder.hpp"

namespace orbitfuse {

/// One file as a frame, and the camera that took it as far as the file says.
struct StillPhoto {
  Frame frame;  ///< host time from the file's own clock, 0 if it has none
  DeviceInfo camera;
  std::string lens;             ///< "4.2 mm (35 mm: 26 mm)", "25.0 degrees"; empty when unknown
  cv::Size size;                ///< upright
  int without_temperature = 0;  ///< samples of a thermal image that none stands for
  double transparent = 0;       ///< share of the pixels whose alpha, which is dropped, says so
  std::string other_pages;      ///< of its TIFF that no frame is made of, in words
  std::string two_scales;       ///< as of ThermalFile
  int orientation = 1;          ///< likewise
  bool lies_across = false;     ///< likewise; of a photo: beside the samples of its file

  /// How a thermal image is held, in words, where that is not as it is stored; else empty.
  std::string how_held() const;
  /// Same key: same camera, lens, image size and kind of samples; of thermal images the size that
  /// the sensor has, however it was held.
  std::string key() const;
  std::string described() const;  ///< the same for people
};

/// Size of the upright image at 35 mm equivalent focal length, in pixels.
double focal_px_of_35mm(double focal_35mm, cv::Size size);

/// Whether a lens may have that focal length: an image of that size spans 1.5 to 130 degrees along
/// its longer side, `angle_deg`.
bool is_of_a_lens(double focal_px, cv::Size size, double* angle_deg = nullptr);

/// What a photo of any format that is read says of itself. Never fails.
ExifInfo exif_of_photo(std::string_view bytes);

/// The bytes of a photo (JPEG, PNG, TIFF, HEIC). Input error naming `where` when they don't decode.
/// `inside`: the radiometric JPEG that it lies in. How the camera was held is said there where the
/// photo itself doesn't: it is stored turned then, as JPEG, but left as it is (`lies_across`) where
/// it stands upright beside broad samples, or the reverse: the camera turned it already, perhaps.
Result<StillPhoto> visible_still(std::string bytes, const std::string& where,
                                 const ThermalFile* inside = nullptr);
/// A frame of a video (CV_8UC3, upright), which is stored as JPEG.
Result<StillPhoto> still_of_video(const cv::Mat& image);
/// A thermal image turned into counts of temperature, or kept as it is when it is 8-bit; counts
/// without a scale stay as the frame's original.
Result<StillPhoto> thermal_still(const ThermalFile& file, const ThermalDecoder& decoder,
                                 const std::string& where);

/// A photo (JPEG, PNG, TIFF) kept byte for byte; HEIC becomes an upright JPEG, which everything
/// reads. Input error when it doesn't decode.
Result<StillPhoto> read_visible_still(const std::filesystem::path& file);
/// As above; `decoder` gets to see 16-bit samples of unknown scale first.
Result<StillPhoto> read_thermal_still(const std::filesystem::path& file, ThermalDecoder& decoder);

/// "FLIR" or "DJI" of a JPEG that holds what a thermal camera measured, else null.
const char* thermal_jpeg_kind(std::string_view bytes);

/// Whether the file is such a JPEG; false also when it can't be read.
bool is_radiometric(const std::filesystem::path& file);

}  // namespace orbitfuse
