// SPDX-License-Identifier: BSD-3-Clause
#include <csetjmp>
#include <cstdio>

#include <jpeglib.h>

// Its messages depend on what jpeglib.h defines.
#include <jerror.h>

#include <fmt/format.h>

#include <opencv2/imgproc.hpp>

#include "core/image/image_codec.hpp"
#include "core/image/jpeg_size.hpp"

namespace orbitfuse {
namespace {

struct JpegErrors {
  jpeg_error_mgr base;
  std::jmp_buf jump;
  char text[JMSG_LENGTH_MAX];
  bool truncated;
  bool damaged;  ///< in the compressed data
  bool in_scan;  ///< past the headers
  bool unread;   ///< of a kind that libjpeg doesn't decode
};

// libjpeg hands base back to the callbacks; it is the first member, so the cast is defined.
JpegErrors& errors_of(j_common_ptr info) { return *reinterpret_cast<JpegErrors*>(info->err); }

void on_fatal(j_common_ptr info) {
  // 12 bits, lossless, arithmetic codes: such a file is whole.
  const int code = info->err->msg_code;
  errors_of(info).unread =
      code == JERR_BAD_PRECISION || code == JERR_SOF_UNSUPPORTED || code == JERR_ARITH_NOTIMPL;
  info->err->format_message(info, errors_of(info).text);
  std::longjmp(errors_of(info).jump, 1);
}

void on_message(j_common_ptr info, int level) {
  if (level >= 0) return;
  // Where a decoder would fill the rest with grey: the data ended early.
  const int code = info->err->msg_code;
  if (code == JWRN_JPEG_EOF || code == JWRN_HIT_MARKER) errors_of(info).truncated = true;
  // Where it would go on with wrong colours: codes that no encoder writes.
  if (code == JWRN_HUFF_BAD_CODE || code == JWRN_ARITH_BAD_CODE || code == JWRN_MUST_RESYNC ||
      code == JWRN_BOGUS_PROGRESSION) {
    errors_of(info).damaged = true;
  }
  // A shifted code often ends its scan early. Cameras pad a few bytes; half a block is damage.
  constexpr int padding = 32;
  if (code == JWRN_EXTRANEOUS_DATA && errors_of(info).in_scan &&
      info->err->msg_parm.i[0] > padding) {
    errors_of(info).damaged = true;
  }
}

/// Plain C style: longjmp may not pass over C++ objects, so everything lives in the caller.
bool decode(std::string_view bytes, jpeg_decompress_struct& info, JpegErrors& errors,
            cv::Mat& image) {
  if (setjmp(errors.jump)) return false;
  jpeg_create_decompress(&info);
  jpeg_mem_src(&info, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  jpeg_read_header(&info, TRUE);
  if (1LL * info.image_width * info.image_height * 3 > max_image_samples) {
    std::snprintf(errors.text, sizeof errors.text, "JPEG of %ux%u", info.image_width,
                  info.image_height);
    return false;
  }
  const bool cmyk = info.jpeg_color_space == JCS_CMYK || info.jpeg_color_space == JCS_YCCK;
  info.out_color_space = info.jpeg_color_space == JCS_GRAYSCALE ? JCS_GRAYSCALE
                         : cmyk                                 ? JCS_CMYK
                                                                : JCS_EXT_BGR;
  errors.in_scan = true;
  jpeg_start_decompress(&info);
  image.create(static_cast<int>(info.output_height), static_cast<int>(info.output_width),
               CV_8UC(info.output_components));
  while (info.output_scanline < info.output_height) {
    JSAMPROW row = image.ptr(static_cast<int>(info.output_scanline));
    jpeg_read_scanlines(&info, &row, 1);
  }
  jpeg_finish_decompress(&info);
  return true;
}

/// As plain as decode(), for the same reason.
bool read_size(std::string_view bytes, jpeg_decompress_struct& info, JpegErrors& errors) {
  if (setjmp(errors.jump)) return false;
  jpeg_create_decompress(&info);
  jpeg_mem_src(&info, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  return jpeg_read_header(&info, TRUE) == JPEG_HEADER_OK;
}

/// Adobe writes CMYK inverted, so that K scales what is left of each ink.
cv::Mat bgr_of_inverted_cmyk(const cv::Mat& cmyk) {
  cv::Mat out(cmyk.size(), CV_8UC3);
  for (int y = 0; y < cmyk.rows; ++y) {
    for (int x = 0; x < cmyk.cols; ++x) {
      const auto& p = cmyk.at<cv::Vec4b>(y, x);
      for (int c = 0; c < 3; ++c) {
        out.at<cv::Vec3b>(y, x)[2 - c] = static_cast<unsigned char>(p[c] * p[3] / 255);
      }
    }
  }
  return out;
}

}  // namespace

std::optional<cv::Size> jpeg_size(std::string_view bytes) {
  if (bytes.empty()) return std::nullopt;
  jpeg_decompress_struct info{};
  JpegErrors errors{};
  info.err = jpeg_std_error(&errors.base);
  errors.base.error_exit = on_fatal;
  errors.base.emit_message = on_message;
  std::optional<cv::Size> size;
  if (read_size(bytes, info, errors))
    size.emplace(static_cast<int>(info.image_width), static_cast<int>(info.image_height));
  jpeg_destroy_decompress(&info);
  return size;
}

Result<cv::Mat> decode_jpeg(std::string_view bytes, const std::string& where) {
  jpeg_decompress_struct info{};
  JpegErrors errors{};
  info.err = jpeg_std_error(&errors.base);
  errors.base.error_exit = on_fatal;
  errors.base.emit_message = on_message;
  cv::Mat image;
  const bool decoded = decode(bytes, info, errors, image);
  jpeg_destroy_decompress(&info);
  if (errors.unread)
    return fail(ErrorKind::input, where,
                fmt::format("a kind of JPEG that is not read ({})", errors.text),
                "convert it to an ordinary JPEG (8 bits, lossy) or to PNG");
  if (!decoded) {
    return fail(ErrorKind::input, where, fmt::format("damaged JPEG ({})", errors.text),
                "copy the file again");
  }
  if (errors.damaged) {
    return fail(ErrorKind::input, where, "damaged JPEG (wrong codes in its image data)",
                "copy the file again");
  }
  if (errors.truncated)
    return fail(ErrorKind::input, where, "truncated JPEG", "copy the file again");
  return image.channels() == 4 ? bgr_of_inverted_cmyk(image) : image;
}

}  // namespace orbitfuse
