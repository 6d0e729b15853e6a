// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/still_photo.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/image/exif.hpp"
#include "core/image/transparency.hpp"
#include "core/numeric/median.hpp"
#include "core/system/file_io.hpp"
#include "drivers/stills/heif_photo.hpp"

namespace orbitfuse {
namespace {

/// Diagonal of the 36 x 24 mm frame that "35 mm equivalent" refers to.
constexpr double full_frame_diagonal_mm = 43.2666;

/// HEIC and frames of videos: next to none of what a phone's compression left is lost; PNG would be
/// ten times as large.
constexpr int as_jpeg_quality = 97;

std::string extension_of_bytes(const std::string& bytes) {
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

bool is_on_its_side(int orientation) { return orientation >= 5; }

cv::Size turned(cv::Size size, int orientation) {
  return is_on_its_side(orientation) ? cv::Size(size.height, size.width) : size;
}

/// Of a photo, as it is stored, and the samples beside it, as the sensor had them.
bool lies_across(cv::Size photo, const ThermalFile& file) {
  if (!file.flir) return false;
  const cv::Size samples = turned(file.flir->signal.size(), file.orientation);
  const auto shape = [](cv::Size s) { return (s.height > s.width) - (s.height < s.width); };
  return shape(photo) * shape(samples) < 0;  // neither is square
}

/// Whether a channel has differences of colours: most of a photo is nearly grey, where they are in
/// the middle of their range.
bool has_differences(const cv::Mat& image, int channel) {
  constexpr int middle = 128, tolerance = 24;  // levels
  cv::Mat levels;
  cv::extractChannel(image, levels, channel);
  std::vector<std::uint8_t> samples(levels.begin<std::uint8_t>(), levels.end<std::uint8_t>());
  return std::abs(median_in(samples) - middle) <= tolerance;
}

/// FLIR's photos that are PNGs hold luma and the two colour differences where PNG has red, green
/// and blue. Nothing says so, and other firmware may write plain colours.
bool is_of_luma_and_differences(const cv::Mat& bgr) {
  return bgr.type() == CV_8UC3 && has_differences(bgr, 0) && has_differences(bgr, 1);
}

/// Of such an image.
cv::Mat bgr_of_flir_png(const cv::Mat& image) {
  constexpr int from_to[] = {2, 0, 0, 1, 1, 2};  // of Cr, Cb, Y to Y, Cr, Cb
  cv::Mat ordered(image.size(), image.type()), out;
  cv::mixChannels(&image, 1, &ordered, 1, from_to, 3);
  cv::cvtColor(ordered, out, cv::COLOR_YCrCb2BGR);
  return out;
}

/// Nothing where EXIF tells none, or one that no lens has (4 mm, 4000 mm): it would be believed.
std::optional<double> believed_35mm(const ExifInfo& exif, cv::Size size) {
  const bool good = exif.focal_35mm && is_of_a_lens(focal_px_of_35mm(*exif.focal_35mm, size), size);
  return good ? exif.focal_35mm : std::nullopt;
}

}  // namespace

double focal_px_of_35mm(double focal_35mm, cv::Size size) {
  return focal_35mm * std::hypot(size.width, size.height) / full_frame_diagonal_mm;
}

bool is_of_a_lens(double focal_px, cv::Size size, double* angle_deg) {
  constexpr double narrowest_deg = 1.5, widest_deg = 130;
  Camera camera;
  camera.width = std::max(size.width, size.height);
  camera.fx = focal_px;
  const double angle = camera.horizontal_fov_deg();
  if (angle_deg) *angle_deg = angle;
  return angle >= narrowest_deg && angle <= widest_deg;
}

ExifInfo exif_of_photo(std::string_view bytes) {
  return is_heif(bytes) ? heif_exif(bytes) : read_exif(bytes);
}

Result<StillPhoto> visible_still(std::string bytes, const std::string& where,
                                 const ThermalFile* inside) {
  StillPhoto still;
  const ExifInfo exif = exif_of_photo(bytes);
  cv::Mat image;
  if (is_heif(bytes)) {
    ORBITFUSE_ASSIGN(image, decode_heif(bytes, where, &still.transparent));
    ORBITFUSE_ASSIGN(bytes, encode_jpeg(image, as_jpeg_quality));
  } else {
    ORBITFUSE_ASSIGN(image, decode_image(bytes, where));
    still.transparent = transparent_share(bytes);
    if (image_format(bytes) == ImageFormat::tiff) still.other_pages = other_tiff_pages(bytes);
  }
  ORBITFUSE_TRY(check_frame_size(image.size(), where));
  if (inside && inside->flir && image_format(bytes) == ImageFormat::png &&
      is_of_luma_and_differences(image)) {
    image = bgr_of_flir_png(image);
    ORBITFUSE_ASSIGN(bytes, encode_png(image));
  }
  // Before it counts as a camera of its own.
  if (image.depth() != CV_8U)
    return fail(ErrorKind::input, where,
                std::string(image.depth() == CV_16U ? "16-bit" : "floating-point") +
                    " samples, but photos have 8 bits",
                "a thermal image? Give it as thermal, or convert it to 8-bit");
  if (inside && inside->orientation != 1 && exif.orientation == 1) {
    still.lies_across = lies_across(image.size(), *inside);
    if (!still.lies_across) {
      image = apply_orientation(image, inside->orientation);
      ORBITFUSE_ASSIGN(bytes, encode_jpeg(image, as_jpeg_quality));
    }
  }
  still.size = apply_orientation(image, exif.orientation).size();
  still.frame.extension = extension_of_bytes(bytes);
  still.frame.encoded = std::move(bytes);
  still.frame.host_time_ns = exif.taken_ns;
  still.camera.modality = Modality::visible;
  still.camera.driver = "stills";
  still.camera.model = exif.make.empty() ? exif.model : exif.make + " " + exif.model;
  still.camera.serial = exif.serial;
  const std::optional<double> equivalent_mm = believed_35mm(exif, still.size);
  if (equivalent_mm) still.camera.lens.focal_px = focal_px_of_35mm(*equivalent_mm, still.size);
  still.lens = exif.focal_mm ? fmt::format("{:g} mm", *exif.focal_mm) : "";
  // A digital zoom changes only the equivalent.
  if (equivalent_mm) still.lens += fmt::format(" (35 mm: {:g} mm)", *equivalent_mm);
  return still;
}

Result<StillPhoto> still_of_video(const cv::Mat& image) {
  StillPhoto still;
  ORBITFUSE_ASSIGN(still.frame.encoded, encode_jpeg(image, as_jpeg_quality));
  still.frame.extension = ".jpg";
  still.size = image.size();
  still.camera.modality = Modality::visible;
  still.camera.driver = "stills";
  still.lens = "of its videos";  // phones crop and stabilise them
  return still;
}

Result<StillPhoto> thermal_still(const ThermalFile& file, const ThermalDecoder& decoder,
                                 const std::string& where) {
  StillPhoto still;
  ORBITFUSE_ASSIGN(const ThermalDecoder::Converted converted, decoder.convert(file, where));
  Frame& frame = still.frame;
  frame.thermal_is_gray = converted.counts.empty();
  frame.kelvin_per_count = converted.kelvin_per_count;
  frame.radiometry = converted.radiometry;
  still.without_temperature = converted.without_temperature;
  still.transparent = file.transparent;
  still.other_pages = file.other_pages;
  still.two_scales = file.two_scales;
  still.orientation = file.orientation;
  still.lies_across = file.lies_across;
  still.size = file.image.size();
  if (converted.keep_bytes) {
    frame.encoded = file.bytes;
    frame.extension = extension_of_bytes(file.bytes);
  } else {
    frame.pixels = frame.thermal_is_gray ? converted.gray : converted.counts;
    still.size = frame.pixels.size();
  }
  if (!converted.gray.empty()) {
    frame.flag(FrameFlag::raw_counts);
    frame.original = file.image;
  }
  frame.host_time_ns = file.taken_ns;
  still.camera.modality = Modality::thermal;
  still.camera.driver = "stills";
  if (file.dji) {
    const ExifInfo& exif = file.dji->exif;
    still.camera.model = exif.model.empty() ? exif.make : exif.make + " " + exif.model;
    still.camera.serial = exif.serial;
    if (exif.focal_mm) still.lens = fmt::format("{:g} mm", *exif.focal_mm);
    if (const auto equivalent_mm = believed_35mm(exif, still.size))
      still.camera.lens.focal_px = focal_px_of_35mm(*equivalent_mm, still.size);
  }
  if (file.flir) {
    still.camera.model = file.flir->camera_model;
    still.camera.serial = file.flir->camera_serial;
    if (const auto fov = file.flir->horizontal_fov_deg) {
      // Of the sensor, which a turn by 90 degrees stood on its side.
      const int across = turned(still.size, file.orientation).width;
      still.camera.lens.focal_px = Camera::from_fov(across, across, *fov).fx;
      still.lens = fmt::format("{:.1f} degrees", *fov);
    }
  }
  return still;
}

Result<StillPhoto> read_visible_still(const std::filesystem::path& file) {
  ORBITFUSE_ASSIGN(std::string bytes, read_file(file, max_image_bytes));
  return visible_still(std::move(bytes), file.string());
}

Result<StillPhoto> read_thermal_still(const std::filesystem::path& path, ThermalDecoder& decoder) {
  ORBITFUSE_ASSIGN(const ThermalFile file, read_thermal_file(path));
  decoder.observe(file, path.filename().string());
  return thermal_still(file, decoder, path.string());
}

std::string StillPhoto::how_held() const {
  if (lies_across)
    return "its temperatures lie across its picture (one is upright, the other not), and no tag "
           "says which way: they stay as the sensor has them";
  return orientation == 1
             ? ""
             : fmt::format("turned upright, as its EXIF says (orientation {})", orientation);
}

std::string StillPhoto::key() const {
  const cv::Size sensor = turned(size, orientation);
  return fmt::format("{}|{}|{}|{}x{}|{}", camera.model, camera.serial, lens, sensor.width,
                     sensor.height, frame.thermal_is_gray);
}

std::string StillPhoto::described() const {
  std::string text = camera.model.empty() ? "unknown camera" : camera.model;
  if (!camera.serial.empty()) text += " " + camera.serial;
  if (!lens.empty()) text += ", lens " + lens;
  return text +
         fmt::format(", {}x{}{}", size.width, size.height, frame.thermal_is_gray ? ", grey" : "");
}

const char* thermal_jpeg_kind(std::string_view bytes) {
  if (is_flir_jpeg(bytes)) return "FLIR";
  return is_dji_thermal(bytes) ? "DJI" : nullptr;
}

bool is_radiometric(const std::filesystem::path& file) {
  const Result<std::string> bytes = read_file(file, max_image_bytes);
  return bytes && thermal_jpeg_kind(*bytes) != nullptr;
}

}  // namespace orbitfuse
