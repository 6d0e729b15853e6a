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
              modality == Modality::visible ? "visible frames are 8-bit grey or colour"
                                            : "thermal frames are 16-bit centikelvin or 8-bit grey");
}

Status check_type(const cv::Mat& image, const Frame& frame, Modality modality, const std::string& where) {
  if (modality == Modality::visible) {
    if (image.depth() != CV_8U) return unfit(where, image, modality);
  } else if (frame.thermal_is_gray) {
    if (image.depth() != CV_8U) return unfit(where, image, modality);
  } else if (image.type() != CV_16UC1) {
    return unfit(where, image, modality);
  }
  return {};
}

}  // namespace

Result<cv::Mat> upright_pixels(const Frame& frame, Modality modality, const std::string& where) {
  if (frame.encoded.empty()) {
    if (frame.pixels.empty())
      return fail(ErrorKind::input, where, "an empty frame", "check the driver");
    ORBITFUSE_TRY(check_type(frame.pixels, frame, modality, where));
    return frame.pixels;
  }
  ORBITFUSE_ASSIGN(const cv::Mat image, decode_image(frame.encoded, where));
  ORBITFUSE_TRY(check_type(image, frame, modality, where));
  return apply_orientation(
      image, modality == Modality::visible ? read_exif(frame.encoded).orientation : 1);
}

Result<EncodedFrame> encode_frame(const Frame& frame, Modality modality, const std::string& where) {
  EncodedFrame out;
  out.has_temperature = modality == Modality::thermal && !frame.thermal_is_gray;
  ORBITFUSE_ASSIGN(out.pixels, upright_pixels(frame, modality, where));
  if (!frame.encoded.empty()) {
    out.bytes = frame.encoded;
    out.extension = frame.extension;
    return out;
  }
  out.extension = out.has_temperature ? ".tiff" : ".png";
  ORBITFUSE_ASSIGN(out.bytes, out.has_temperature ? encode_thermal_tiff(frame.pixels)
                                                  : encode_png(frame.pixels));
  return out;
}

}  // namespace orbitfuse
