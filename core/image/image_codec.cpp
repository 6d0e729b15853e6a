// SPDX-License-Identifier: BSD-3-Clause
#include "core/image/image_codec.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace orbitfuse {
namespace {

bool starts_with(std::string_view bytes, std::string_view magic) {
  return bytes.substr(0, magic.size()) == magic;
}

std::uint32_t big_endian_u32(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

/// OpenCV fills what a cut PNG lacks; the chunk list tells whether the file is whole.
bool png_is_whole(std::string_view bytes) {
  std::size_t at = 8;
  while (at + 12 <= bytes.size()) {
    const std::size_t length = big_endian_u32(bytes, at);
    if (length > bytes.size() || at + 12 + length > bytes.size()) return false;
    if (bytes.substr(at + 4, 4) == "IEND") return true;
    at += 12 + length;
  }
  return false;
}

Result<cv::Mat> decode_with_opencv(std::string_view bytes, const std::string& where) {
  cv::Mat image;
  try {
    const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8UC1,
                         const_cast<char*>(bytes.data()));
    image = cv::imdecode(buffer, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
    image.release();
  }
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
  } catch (const cv::Exception&) {
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
    case ImageFormat::jpeg: return "JPEG";
    case ImageFormat::png: return "PNG";
    case ImageFormat::tiff: return "TIFF";
    case ImageFormat::bmp: return "BMP";
    case ImageFormat::unknown: break;
  }
  return "unknown content";
}

Result<cv::Mat> decode_image(std::string_view bytes, const std::string& where) {
  const ImageFormat format = image_format(bytes);
  if (bytes.empty()) return fail(ErrorKind::input, where, "empty file", "copy the file again");
  switch (format) {
    case ImageFormat::jpeg: return decode_jpeg(bytes, where);
    case ImageFormat::tiff: {
      ORBITFUSE_ASSIGN(cv::Mat image, decode_tiff(bytes, where));
      if (image.depth() == CV_32F) {
        return fail(ErrorKind::input, where, "32-bit float samples, 8 or 16-bit expected",
                    "convert it to 8 or 16-bit");
      }
      return image;
    }
    case ImageFormat::png: {
      if (bytes.size() < 33 || !png_is_whole(bytes)) {
        return fail(ErrorKind::input, where, "truncated PNG", "copy the file again");
      }
      const long long samples = 1LL * big_endian_u32(bytes, 16) * big_endian_u32(bytes, 20);
      if (samples <= 0 || samples > max_image_samples) {
        return fail(ErrorKind::input, where, "PNG with a damaged size", "copy the file again");
      }
      return decode_with_opencv(bytes, where);
    }
    case ImageFormat::bmp: return decode_with_opencv(bytes, where);
    case ImageFormat::unknown: break;
  }
  return fail(ErrorKind::input, where, "not an image (JPEG, PNG, TIFF or BMP)",
              "remove the file or convert it");
}

cv::Mat apply_orientation(const cv::Mat& image, int orientation) {
  cv::Mat out;
  switch (orientation) {
    case 2: cv::flip(image, out, 1); return out;
    case 3: cv::rotate(image, out, cv::ROTATE_180); return out;
    case 4: cv::flip(image, out, 0); return out;
    case 5: cv::transpose(image, out); return out;
    case 6: cv::rotate(image, out, cv::ROTATE_90_CLOCKWISE); return out;
    case 7:
      cv::transpose(image, out);
      cv::rotate(out, out, cv::ROTATE_180);
      return out;
    case 8: cv::rotate(image, out, cv::ROTATE_90_COUNTERCLOCKWISE); return out;
    default: return image;
  }
}

std::optional<ThermalScaleTag> thermal_scale_of_json(std::string_view json) {
  const auto value = nlohmann::json::parse(json, nullptr, false);
  if (!value.is_object() || !value.contains("scale") || !value["scale"].is_number()) return std::nullopt;
  ThermalScaleTag tag;
  tag.scale = value["scale"].get<double>();
  if (value.contains("offset") && value["offset"].is_number()) tag.offset = value["offset"].get<double>();
  if (!(tag.scale > 0) || !std::isfinite(tag.scale) || !std::isfinite(tag.offset)) return std::nullopt;
  return tag;
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

std::string thermal_sidecar_json() {
  return R"({"quantity":"temperature","unit":"kelvin","scale":0.01,"offset":0,"invalid":0})";
}

Result<std::string> encode_thermal_tiff(const cv::Mat& centikelvin) {
  return encode_tiff(centikelvin, thermal_sidecar_json());
}

}  // namespace orbitfuse
