// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/still_photo.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "core/exif.hpp"
#include "core/file_io.hpp"

namespace orbitfuse {
namespace {

/// Diagonal of the 36 x 24 mm frame that "35 mm equivalent" refers to.
constexpr double full_frame_diagonal_mm = 43.2666;

std::string extension_of(const std::string& bytes) {
  switch (image_format(bytes)) {
    case ImageFormat::jpeg:
      return ".jpg";
    case ImageFormat::png:
      return ".png";
    case ImageFormat::tiff:
      return ".tiff";
    default:
      return ".bmp";
  }
}

}  // namespace

double focal_px_of_35mm(double focal_35mm, cv::Size size) {
  return focal_35mm * std::hypot(size.width, size.height) / full_frame_diagonal_mm;
}

Result<StillPhoto> read_visible_still(const std::filesystem::path& file) {
  StillPhoto still;
  ORBITFUSE_ASSIGN(still.frame.encoded, read_file(file));
  ORBITFUSE_ASSIGN(const cv::Mat image, decode_image(still.frame.encoded, file.string()));
  const ExifInfo exif = read_exif(still.frame.encoded);
  const cv::Size size = apply_orientation(image, exif.orientation).size();
  still.frame.extension = extension_of(still.frame.encoded);
  still.frame.host_time_ns = exif.taken_ns.value_or(0);
  still.camera.modality = Modality::visible;
  still.camera.model = exif.make.empty() ? exif.model : exif.make + " " + exif.model;
  still.camera.serial = exif.serial;
  if (exif.focal_35mm) still.camera.lens.focal_px = focal_px_of_35mm(*exif.focal_35mm, size);
  still.key = fmt::format("{}|{}|{}x{}", still.camera.model, exif.focal_mm.value_or(0), size.width,
                          size.height);
  return still;
}

Result<StillPhoto> read_thermal_still(const std::filesystem::path& path, ThermalDecoder& decoder) {
  StillPhoto still;
  ORBITFUSE_ASSIGN(ThermalFile file, read_thermal_file(path));
  decoder.observe(file);
  ORBITFUSE_ASSIGN(ThermalDecoder::Converted converted, decoder.convert(file, path.string()));
  Frame& frame = still.frame;
  frame.thermal_is_gray = converted.centikelvin.empty();
  cv::Size size = file.image.size();
  if (converted.keep_bytes) {
    frame.encoded = file.bytes;
    frame.extension = extension_of(file.bytes);
  } else {
    frame.pixels = frame.thermal_is_gray ? converted.gray : converted.centikelvin;
    size = frame.pixels.size();
  }
  if (!converted.gray.empty()) {
    frame.flags.push_back("raw-counts");
    frame.original = file.image;
  }
  frame.host_time_ns =
      (file.flir ? file.flir->taken_ns : read_exif(file.bytes).taken_ns).value_or(0);
  still.camera.modality = Modality::thermal;
  if (file.flir) {
    still.camera.model = file.flir->camera_model;
    still.camera.serial = file.flir->camera_serial;
    if (const auto fov = file.flir->horizontal_fov_deg) {
      still.camera.lens.focal_px = 0.5 * size.width / std::tan(0.5 * *fov * std::numbers::pi / 180);
    }
  }
  still.key = fmt::format("{}|{}x{}|{}", still.camera.model, size.width, size.height,
                          frame.thermal_is_gray);
  return still;
}

bool is_radiometric(const std::filesystem::path& file) {
  const Result<std::string> bytes = read_file(file);
  return bytes && is_flir_jpeg(*bytes);
}

}  // namespace orbitfuse
