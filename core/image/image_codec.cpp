// SPDX-License-Identifier: BSD-3-Clause
#include "core/image/image_codec.hpp"

#include <fmt/format.h>

#include <cctype>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/image/temperature_unit.hpp"
#include "core/image/transparency.hpp"
#include "core/nested_text.hpp"

namespace orbitfuse {
namespace {

constexpr double max_scale_number = 1e4;  // kelvin per count, kelvin

bool starts_with(std::string_view bytes, std::string_view magic) {
  return bytes.substr(0, magic.size()) == magic;
}

std::uint32_t little_endian(std::string_view bytes, std::size_t at, std::size_t count) {
  std::uint32_t value = 0;
  for (std::size_t i = count; i > 0; --i)
    value = value << 8 | static_cast<unsigned char>(bytes[at + i - 1]);
  return value;
}

/// OpenCV prints what it finds wrong with a BMP, without a file's name: it gets only whole ones.
bool bmp_is_whole(std::string_view bytes) {
  if (bytes.size() < 54) return false;
  const std::uint64_t pixels_at = little_endian(bytes, 10, 4);
  const std::uint64_t header = little_endian(bytes, 14, 4);
  const auto width = static_cast<std::int32_t>(little_endian(bytes, 18, 4));
  const auto height = static_cast<std::int32_t>(little_endian(bytes, 22, 4));
  const std::uint64_t rows = static_cast<std::uint64_t>(std::abs(std::int64_t{height}));
  const std::uint32_t bits = little_endian(bytes, 28, 2), compression = little_endian(bytes, 30, 4);
  std::uint64_t colors = little_endian(bytes, 46, 4);
  if (header < 40 || header > 200 || width <= 0 || width > 65536 || rows == 0 || rows > 65536)
    return false;
  const bool plain = compression == 0 && (bits == 8 || bits == 24 || bits == 32);
  const bool masked = compression == 3 && bits == 32;
  if ((!plain && !masked) || colors > 256) return false;
  if (bits == 8 && colors == 0) colors = 256;
  const std::uint64_t row_bytes = (static_cast<std::uint64_t>(width) * bits + 31) / 32 * 4;
  const std::uint64_t palette_end = 14 + header + 4 * colors + (masked ? 12 : 0);
  return palette_end <= bytes.size() && pixels_at >= 54 && pixels_at <= bytes.size() &&
         row_bytes * rows <= bytes.size() - pixels_at;
}

/// As OpenCV decodes it, with a fourth channel where it has one; none where it can't.
cv::Mat stored_bmp(std::string_view bytes) {
  cv::Mat image;
  try {
    const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8UC1,
                         const_cast<char*>(bytes.data()));
    image = cv::imdecode(buffer, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception& error) {
    if (error.code == cv::Error::StsNoMem) throw;
    image.release();
  }
  return image;
}

/// The fourth byte of a pixel is alpha only where a header of version 4 on has a mask for it;
/// others leave it 0.
double bmp_transparent_share(std::string_view bytes) {
  if (!bmp_is_whole(bytes) || little_endian(bytes, 14, 4) < 108 ||
      little_endian(bytes, 30, 4) != 3 || little_endian(bytes, 66, 4) != 0xff000000)
    return 0;
  const cv::Mat image = stored_bmp(bytes);
  return image.type() == CV_8UC4 ? transparent_share(image) : 0;
}

Result<cv::Mat> decode_bmp(std::string_view bytes, const std::string& where) {
  if (!bmp_is_whole(bytes)) {
    return fail(ErrorKind::input, where, "truncated, damaged or compressed BMP",
                "copy the file again, or convert it to PNG");
  }
  cv::Mat image = stored_bmp(bytes);
  if (image.empty() || (image.depth() != CV_8U && image.depth() != CV_16U)) {
    return fail(ErrorKind::input, where, "truncated or damaged image", "copy the file again");
  }
  if (image.channels() == 4) cv::cvtColor(image, image, cv::COLOR_BGRA2BGR);
  return image;
}

template <class Encode>
Result<std::string> encoded(const Encode& encode, const char* what) {
  std::vector<unsigned char> buffer;
  bool ok = false;
  try {
    ok = encode(buffer);
  } catch (const cv::Exception& error) {
    if (error.code == cv::Error::StsNoMem) throw;
  }
  if (!ok) return fail(ErrorKind::device, what, "encoder failed", "report this");
  return std::string(buffer.begin(), buffer.end());
}

}  // namespace

ImageFormat image_format(std::string_view bytes) {
  using namespace std::string_view_literals;
  if (starts_with(bytes, "\xFF\xD8\xFF"sv)) return ImageFormat::jpeg;
  if (starts_with(bytes, "\x89PNG\r\n\x1A\n"sv)) return ImageFormat::png;
  if (starts_with(bytes, "II*\0"sv) || starts_with(bytes, "MM\0*"sv) ||
      starts_with(bytes, "II+\0"sv) || starts_with(bytes, "MM\0+"sv)) {
    return ImageFormat::tiff;
  }
  if (starts_with(bytes, "BM"sv)) return ImageFormat::bmp;
  return ImageFormat::unknown;
}

const char* name(ImageFormat format) {
  switch (format) {
    case ImageFormat::jpeg:
      return "JPEG";
    case ImageFormat::png:
      return "PNG";
    case ImageFormat::tiff:
      return "TIFF";
    case ImageFormat::bmp:
      return "BMP";
    case ImageFormat::unknown:
      break;
  }
  return "unknown content";
}

Result<cv::Mat> decode_image(std::string_view bytes, const std::string& where) {
  const ImageFormat format = image_format(bytes);
  if (bytes.empty()) return fail(ErrorKind::input, where, "empty file", "copy the file again");
  switch (format) {
    case ImageFormat::jpeg:
      return decode_jpeg(bytes, where);
    case ImageFormat::tiff: {
      ORBITFUSE_ASSIGN(cv::Mat image, decode_tiff(bytes, where));
      if (image.depth() == CV_32F) {
        return fail(ErrorKind::input, where, "32-bit float samples, 8 or 16-bit expected",
                    "convert it to 8 or 16-bit");
      }
      return image;
    }
    case ImageFormat::png:
      return decode_png(bytes, where);
    case ImageFormat::bmp:
      return decode_bmp(bytes, where);
    case ImageFormat::unknown:
      break;
  }
  const char* known = name_of_other_format(bytes);
  return fail(
      ErrorKind::input, where,
      known ? fmt::format("{}, which is not read", known) : "not an image (JPEG, PNG, TIFF or BMP)",
      known ? "convert it to JPEG, PNG or TIFF" : "remove the file or convert it");
}

double transparent_share(std::string_view bytes, std::optional<int> page) {
  switch (image_format(bytes)) {
    case ImageFormat::png:
      return png_transparent_share(bytes);
    case ImageFormat::tiff:
      return tiff_transparent_share(bytes, page);
    case ImageFormat::bmp:
      return bmp_transparent_share(bytes);
    default:
      return 0;
  }
}

double transparent_share(const cv::Mat& image) {
  cv::Mat alpha;
  cv::extractChannel(image, alpha, image.channels() - 1);
  const double opaque = image.depth() == CV_16U ? 65535 : 255;
  return static_cast<double>(cv::countNonZero(alpha < opaque)) / static_cast<double>(alpha.total());
}

const char* name_of_other_format(std::string_view bytes) {
  using namespace std::string_view_literals;
  if (bytes.size() < 12) return nullptr;
  if (bytes.substr(0, 4) == "RIFF"sv && bytes.substr(8, 4) == "WEBP"sv) return "a WebP image";
  if (bytes.substr(0, 3) == "GIF"sv) return "a GIF image";
  if (bytes.substr(0, 4) == "FFF\0"sv || bytes.substr(0, 4) == "AFF\0"sv) return "a FLIR recording";
  if (bytes.substr(4, 4) != "ftyp"sv) return nullptr;
  const std::string_view brand = bytes.substr(8, 4);
  for (const std::string_view heif :
       {"heic"sv, "heix"sv, "hevc"sv, "mif1"sv, "msf1"sv, "heim"sv, "heis"sv}) {
    if (brand == heif) return "a HEIC image";
  }
  return brand == "avif"sv ? "an AVIF image" : "a video";
}

cv::Mat apply_orientation(const cv::Mat& image, int orientation) {
  cv::Mat out;
  switch (orientation) {
    case 2:
      cv::flip(image, out, 1);
      return out;
    case 3:
      cv::rotate(image, out, cv::ROTATE_180);
      return out;
    case 4:
      cv::flip(image, out, 0);
      return out;
    case 5:
      cv::transpose(image, out);
      return out;
    case 6:
      cv::rotate(image, out, cv::ROTATE_90_CLOCKWISE);
      return out;
    case 7:
      cv::transpose(image, out);
      cv::rotate(out, out, cv::ROTATE_180);
      return out;
    case 8:
      cv::rotate(image, out, cv::ROTATE_90_COUNTERCLOCKWISE);
      return out;
    default:
      return image;
  }
}

namespace {

/// Whether text that is no JSON was to be that of a scale: cut off, perhaps before the number.
/// Other programs write anything into an ImageDescription.
bool is_of_a_scale(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  if (begin == text.npos || text[begin] != '{') return false;
  for (const std::string_view word : {"\"scale", "\"temperature\"", "\"kelvin\""})
    if (text.find(word) != text.npos) return true;
  return false;
}

/// Of a name as people and programs write it.
std::optional<TemperatureUnit> temperature_unit_called(std::string name) {
  for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const std::string_view frill : {"degrees", "degree", "deg", "\u00b0", "[", "]", " ", "_"})
    for (std::size_t at; (at = name.find(frill)) != name.npos;) name.erase(at, frill.size());
  if (name == "k" || name == "kelvin" || name == "kelvins") return TemperatureUnit::kelvin;
  if (name == "c" || name == "celsius" || name == "centigrade") return TemperatureUnit::celsius;
  for (const char* other :
       {"f", "fahrenheit", "rankine", "centikelvin", "ck", "millikelvin", "mk", "decikelvin", "dk"})
    if (name == other) return TemperatureUnit::other;
  return std::nullopt;
}

}  // namespace

std::optional<TemperatureUnit> temperature_unit_of(std::string_view text) {
  const auto value = parse_json(text);
  if (!value.is_object() || !value.contains("unit") || !value["unit"].is_string())
    return std::nullopt;
  return temperature_unit_called(value["unit"].get<std::string>());
}

bool says_zero_is_none(std::string_view text) {
  const auto value = parse_json(text);
  return value.is_object() && value.contains("invalid") && value["invalid"] == 0;
}

Status check_invalid(std::string_view text, const std::string& where) {
  const auto value = parse_json(text);
  if (!value.is_object() || !value.contains("invalid")) return {};
  // 0 is what the samples of this program have for none.
  const auto& invalid = value["invalid"];
  if (invalid.is_null() || invalid == 0) return {};
  return fail(ErrorKind::input, where, fmt::format("\"invalid\": {}", invalid.dump().substr(0, 40)),
              "only 0 marks samples without a temperature: set those samples to 0, and write "
              "\"invalid\": 0");
}

Result<std::optional<ThermalScaleTag>> thermal_scale_of_description(std::string_view text,
                                                                    const std::string& where) {
  const auto value = parse_json(text);
  // Passed over, its counts would be taken for others.
  if (value.is_discarded() && is_of_a_scale(text))
    return fail(ErrorKind::input, where, json_fault(text),
                "correct the text that has its \"scale\" (the sidecar, or ImageDescription)");
  if (!value.is_object() || !value.contains("scale")) return std::nullopt;
  ThermalScaleTag tag;
  const auto read = [&](const char* key, double& number) -> Status {
    if (!value.contains(key)) return {};
    if (value[key].is_number()) number = value[key].get<double>();
    // Beyond these nothing is a temperature, and arithmetic in float would overflow.
    if (value[key].is_number() && std::isfinite(number) && std::abs(number) <= max_scale_number)
      return {};
    return fail(ErrorKind::input, where,
                fmt::format("\"{}\": {}", key, value[key].dump().substr(0, 40)),
                "kelvin = scale * count + offset; correct the two numbers");
  };
  ORBITFUSE_TRY(read("scale", tag.scale));
  ORBITFUSE_TRY(read("offset", tag.offset));
  ORBITFUSE_TRY(check_invalid(text, where));
  // Celsius would be off by 273 and look like a temperature all the same.
  if (const auto unit = value.find("unit"); unit != value.end() && unit->is_string()) {
    if (temperature_unit_called(unit->get<std::string>()) != TemperatureUnit::kelvin)
      return fail(ErrorKind::input, where, fmt::format("\"unit\": {}", unit->dump().substr(0, 40)),
                  "only kelvin = scale * count + offset is read (of Celsius add 273.15 to the "
                  "offset): write \"unit\": \"kelvin\"");
  }
  if (!(tag.scale > 0)) {
    return fail(ErrorKind::input, where, fmt::format("\"scale\": {}", tag.scale),
                "kelvin per count must be > 0");
  }
  return tag;
}

Result<ThermalScaleTag> thermal_scale_of_sidecar(std::string_view text, const std::string& where) {
  ORBITFUSE_ASSIGN(const auto tag, thermal_scale_of_description(text, where));
  if (tag) return *tag;
  return fail(ErrorKind::input, where, "no usable \"scale\" (kelvin per count)",
              "correct or remove the sidecar");
}

Result<std::string> encode_png(const cv::Mat& image) {
  return encoded([&](auto& buffer) { return cv::imencode(".png", image, buffer); }, "PNG");
}

Result<std::string> encode_jpeg(const cv::Mat& image, int quality) {
  return encoded(
      [&](auto& buffer) {
        return cv::imencode(".jpg", image, buffer, {cv::IMWRITE_JPEG_QUALITY, quality});
      },
      "JPEG");
}

std::string thermal_sidecar_json(ThermalScaleTag scale) {
  return fmt::format(
      R"({{"quantity":"temperature","unit":"kelvin","scale":{:g},"offset":{:g},"invalid":0}})",
      scale.scale, scale.offset);
}

Result<std::string> encode_thermal_tiff(const cv::Mat& counts, ThermalScaleTag scale) {
  return encode_tiff(counts, thermal_sidecar_json(scale));
}

}  // namespace orbitfuse
