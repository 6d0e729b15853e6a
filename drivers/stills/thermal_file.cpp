// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/thermal_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/image/exif.hpp"
#include "core/image/jpeg_size.hpp"
#include "core/image/temperature_unit.hpp"
#include "core/image/transparency.hpp"
#include "core/system/file_io.hpp"
#include "core/temperature.hpp"

namespace orbitfuse {
namespace {

Result<FlirImage> recorded_image(std::string_view bytes, const std::string& where,
                                 std::optional<int> page,
                                 const std::vector<std::string_view>* known_frames) {
  std::vector<std::string_view> found;
  if (!known_frames) found = flir_recording_frames(bytes);
  const std::vector<std::string_view>& frames = known_frames ? *known_frames : found;
  if (!page && frames.size() > 1) {
    return fail(ErrorKind::input, where,
                fmt::format("a recording of {} images, one expected", frames.size()),
                "import it: every image becomes a frame");
  }
  const auto index = static_cast<std::size_t>(page.value_or(0));
  return read_flir_file(index < frames.size() ? frames[index] : bytes, where);
}

/// By more than numbers that were written with a few digits do.
bool differ(const ThermalScaleTag& a, const ThermalScaleTag& b) {
  constexpr double written = 1e-5;
  return std::abs(a.scale - b.scale) > written * a.scale ||
         std::abs(a.offset - b.offset) > written * std::abs(a.offset) + 1e-3;
}

bool is_upright_format(cv::Size size) { return size.height > size.width; }

/// EXIF tells how the JPEG's own picture is to be held. The samples beside it lie as the sensor has
/// them, which is as that picture is stored, unless the camera turned it already: then nothing says
/// which way.
void turn_upright(FlirImage& flir, std::string_view jpeg, ThermalFile& file) {
  const std::optional<cv::Size> picture = jpeg_size(jpeg);
  const bool square = flir.signal.rows == flir.signal.cols;
  if (picture && !square && is_upright_format(*picture) != is_upright_format(flir.signal.size())) {
    file.lies_across = true;
    return;
  }
  file.orientation = read_exif(jpeg).orientation;
  flir.signal = apply_orientation(flir.signal, file.orientation);
}

void take_time(ThermalFile& file, const ExifInfo& exif) {
  file.taken_ns = exif.taken_ns;
  if (exif.taken_has_offset) file.utc_offset_s = exif.utc_offset_s;
}

/// What the text, of the file or its sidecar, says of samples that are none. Only where it names a
/// scale or unit: the word may mean anything in other programs' texts.
Status read_invalid(ThermalFile& file, std::string_view text, const std::string& where) {
  ORBITFUSE_TRY(check_invalid(text, where));
  if (file.kind == ThermalFile::Kind::floats && says_zero_is_none(text))
    file.image.setTo(invalid_k, file.image == 0);
  return {};
}

/// What the text, of the file or its sidecar, says of a unit where it names no scale.
Status read_unit(ThermalFile& file, std::string_view text, const std::string& where) {
  const auto unit = temperature_unit_of(text);
  if (!unit) return {};
  const bool are_floats = file.kind == ThermalFile::Kind::floats;
  if (*unit == TemperatureUnit::other || (!are_floats && *unit == TemperatureUnit::celsius))
    return fail(ErrorKind::input, where, "a \"unit\" that is not kelvin, and no \"scale\"",
                "give kelvin = scale * sample + offset, as {\"scale\": 0.01, \"offset\": 273.15} "
                "for hundredths of a degree Celsius");
  if (are_floats)
    file.unit = *unit == TemperatureUnit::kelvin ? FloatUnit::kelvin : FloatUnit::celsius;
  return {};
}

Status read_sidecar(ThermalFile& file, const std::filesystem::path& sidecar) {
  ORBITFUSE_ASSIGN(const std::string text, read_file(sidecar, max_settings_bytes));
  const std::string where = sidecar.string();
  const auto beside = thermal_scale_of_sidecar(text, where);
  if ((file.tag || file.unit) && !beside) {
    file.two_scales = fmt::format("it has a {} of its own; its sidecar is passed over ({})",
                                  file.tag ? "scale" : "unit", beside.error().found);
  } else if (file.tag && differ(*file.tag, *beside)) {
    file.two_scales = fmt::format(
        "its own tag says {:g} K a count from {:g} K on, {} {:g} K from {:g} K on, which is passed "
        "over: delete the one that is wrong",
        file.tag->scale, file.tag->offset, sidecar.filename().string(), beside->scale,
        beside->offset);
  } else if (!file.tag && beside) {
    file.tag = *beside;
    ORBITFUSE_TRY(read_invalid(file, text, where));
  } else if (!beside) {
    // Floats need no scale, only a unit.
    if (thermal_scale_of_description(text, where)) {
      ORBITFUSE_TRY(read_unit(file, text, where));
      if (file.unit) {
        ORBITFUSE_TRY(read_invalid(file, text, where));
      }
    }
    if (!file.unit) return tl::unexpected(beside.error());
  }
  return {};
}

/// Of 16-bit samples and floats: the scale or unit of the file's own, else of its sidecar, which of
/// a DJI file is the user's word.
Status read_meaning(ThermalFile& file, const std::string& description, const std::string& where) {
  ORBITFUSE_ASSIGN(file.tag, thermal_scale_of_description(description, where));
  // A sidecar's scale makes up for another unit (below), not for this.
  if (file.tag || temperature_unit_of(description)) {
    ORBITFUSE_TRY(read_invalid(file, description, where));
  }
  const Status own_unit = file.tag ? Status{} : read_unit(file, description, where);
  const std::filesystem::path sidecar = where + ".json";
  std::error_code ignored;
  if (std::filesystem::exists(sidecar, ignored)) {
    ORBITFUSE_TRY(read_sidecar(file, sidecar));
  }
  // A scale beside it says how another unit becomes kelvin.
  return file.tag ? Status{} : own_unit;
}

}  // namespace

Status check_frame_size(cv::Size size, const std::string& where) {
  constexpr int least_side_px = 4;  // the smallest thermal sensors have 16 x 4
  if (std::min(size.width, size.height) >= least_side_px) return {};
  return fail(ErrorKind::input, where,
              fmt::format("{}x{} pixels, a frame has at least {}x{}", size.width, size.height,
                          least_side_px, least_side_px),
              "was it cut or scaled by mistake?");
}

Result<ThermalFile> read_thermal_file(const std::filesystem::path& path, std::optional<int> page) {
  ORBITFUSE_ASSIGN(const std::string bytes, read_file(path, max_image_bytes));
  return thermal_file(bytes, path, page);
}

int thermal_page_count(std::string_view bytes) {
  if (is_flir_recording(bytes))
    return std::max(1, static_cast<int>(flir_recording_frames(bytes).size()));
  return image_format(bytes) == ImageFormat::tiff ? tiff_page_count(bytes).value_or(1) : 1;
}

Result<ThermalFile> thermal_file(std::string_view bytes, const std::filesystem::path& path,
                                 std::optional<int> page,
                                 const std::vector<std::string_view>* known_frames) {
  ThermalFile file;
  const std::string where = path.string();
  const bool recording = is_flir_recording(bytes);
  if (recording || is_flir_jpeg(bytes)) {
    file.kind = ThermalFile::Kind::radiometric_jpeg;
    ORBITFUSE_ASSIGN(file.flir, recording ? recorded_image(bytes, where, page, known_frames)
                                          : read_flir_jpeg(bytes, where));
    ORBITFUSE_TRY(check_frame_size(file.flir->signal.size(), where));
    file.taken_ns = file.flir->taken_ns;
    if (file.taken_ns) file.utc_offset_s = file.flir->utc_offset_s;
    if (!recording && !file.taken_ns) take_time(file, read_exif(bytes));
    if (!recording) turn_upright(*file.flir, bytes, file);
    return file;
  }
  std::string description;
  if (is_dji_thermal(bytes)) {
    ORBITFUSE_ASSIGN(file.dji, read_dji_thermal(bytes, where));
    file.image = file.dji->counts;
  } else if (image_format(bytes) == ImageFormat::tiff) {
    ORBITFUSE_ASSIGN(file.image, decode_tiff(bytes, where, &description, page));
    if (page.value_or(0) == 0) file.other_pages = other_tiff_pages(bytes);
  } else {
    ORBITFUSE_ASSIGN(file.image, decode_image(bytes, where));
  }
  ORBITFUSE_TRY(check_frame_size(file.image.size(), where));
  const ExifInfo exif = read_exif(bytes);
  take_time(file, exif);
  file.orientation = exif.orientation;
  if (page && image_format(bytes) == ImageFormat::tiff)
    file.orientation = tiff_orientation(bytes, page).value_or(1);
  file.image = apply_orientation(file.image, file.orientation);
  file.transparent = transparent_share(bytes, page);
  if (file.image.depth() == CV_8U) {
    // Whoever reads thermal frames takes them as they are stored, one image a file.
    const bool one_of_several = page && thermal_page_count(bytes) > 1;
    if (file.orientation != 1 || one_of_several) {
      ORBITFUSE_ASSIGN(file.bytes, encode_png(file.image));
    } else {
      file.bytes = bytes;
    }
    return file;
  }
  const bool are_floats = file.image.type() == CV_32FC1;
  if (!are_floats && file.image.type() != CV_16UC1) {
    return fail(
        ErrorKind::input, where,
        fmt::format("{} channels of {} bits", file.image.channels(), 8 * file.image.elemSize1()),
        "thermal images are 16-bit grey (100 x kelvin), float grey, 8-bit or FLIR radiometric "
        "JPEGs");
  }
  file.kind = are_floats ? ThermalFile::Kind::floats : ThermalFile::Kind::samples16;
  ORBITFUSE_TRY(read_meaning(file, description, where));
  return file;
}

}  // namespace orbitfuse
