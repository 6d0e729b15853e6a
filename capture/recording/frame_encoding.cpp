// SPDX-License-Identifier: BSD-3-Clause
#include "capture/recording/frame_encoding.hpp"

#include <fmt/format.h>

#include "core/image/exif.hpp"
#include "core/image/image_codec.hpp"

namespace orbitfuse {
namespace {

tl::unexpected<Error> unfit(const std::string& where, const cv::Mat& image, Modality modality) {
  return fail(ErrorKind::input, where,
              fmt::format("{}-bit samples in {} channels", 8 * image.elemSize1(), image.channels()),
              modality == Modality::visible
                  ? "visible frames are 8-bit grey or colour"
                  : "thermal frames are 16-bit counts of temperature or 8-bit grey");
}

Status check_type(const cv::Mat& image, const Frame& frame, Modality modality,
                  const std::string& where) {
  const bool gray = modality == Modality::visible || frame.thermal_is_gray;
  const bool fits = gray ? image.depth() == CV_8U : image.type() == CV_16UC1;
  if (!fits) return unfit(where, image, modality);
  return {};
}

}  // namespace

Result<UprightFrame> upright_frame(const Frame& frame, Modality modality,
                                   const std::string& where) {
  UprightFrame upright;
  upright.scale = {frame.kelvin_per_count, 0};
  if (frame.encoded.empty()) {
    if (frame.pixels.empty())
      return fail(ErrorKind::input, where, "an empty frame", "check the driver");
    ORBITFUSE_TRY(check_type(frame.pixels, frame, modality, where));
    upright.pixels = frame.pixels;
    return upright;
  }
  cv::Mat image;
  std::string description;  // of a TIFF
  if (image_format(frame.encoded) == ImageFormat::tiff) {
    ORBITFUSE_ASSIGN(image, decode_tiff(frame.encoded, where, &description));
  } else {
    ORBITFUSE_ASSIGN(image, decode_image(frame.encoded, where));
  }
  ORBITFUSE_TRY(check_type(image, frame, modality, where));
  if (modality == Modality::thermal && !frame.thermal_is_gray) {
    ORBITFUSE_ASSIGN(const auto tag, thermal_scale_of_description(description, where));
    if (tag) upright.scale = *tag;
  }
  upright.pixels = apply_orientation(
      image, modality == Modality::visible ? read_exif(frame.encoded).orientation : 1);
  return upright;
}

Result<EncodedFrame> encode_frame(const Frame& frame, Modality modality, const std::string& where) {
  ORBITFUSE_ASSIGN(UprightFrame upright, upright_frame(frame, modality, where));
  EncodedFrame out;
  out.has_temperature = modality == Modality::thermal && !frame.thermal_is_gray;
  out.pixels = std::move(upright.pixels);
  out.scale = upright.scale;
  if (!frame.encoded.empty()) {
    out.bytes = frame.encoded;
    out.extension = frame.extension;
    return out;
  }
  out.extension = out.has_temperature ? ".tiff" : ".png";
  ORBITFUSE_ASSIGN(out.bytes, out.has_temperature ? encode_thermal_tiff(out.pixels, out.scale)
                                                  : encode_png(out.pixels));
  return out;
}

}  // namespace orbitfuse
