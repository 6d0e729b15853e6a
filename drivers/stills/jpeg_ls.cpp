// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/jpeg_ls.hpp"

#include <charls/charls.h>
#include <fmt/format.h>

#include "core/image/image_codec.hpp"

namespace orbitfuse {

bool is_jpeg_ls(std::string_view bytes) {
  // SOI, then the start of a JPEG-LS frame or the header (SPIFF) that may come before it.
  return bytes.substr(0, 4) == "\xFF\xD8\xFF\xF7" || bytes.substr(0, 4) == "\xFF\xD8\xFF\xE8";
}

Result<cv::Mat> decode_jpeg_ls(std::string_view bytes, const std::string& where) {
  const auto damaged = [&](const std::string& found) {
    return fail(ErrorKind::input, where, found, "copy the file from the camera again");
  };
  // CharLS 2.4 counts zero bits for seconds where codes run into the end of the bytes; a marker
  // ends them.
  const std::string marked = std::string(bytes) + "\xFF\xD9";
  try {
    charls::jpegls_decoder decoder;
    decoder.source(marked.data(), marked.size());
    decoder.read_spiff_header();
    decoder.read_header();
    const charls::frame_info frame = decoder.frame_info();
    if (frame.component_count != 1 || frame.bits_per_sample < 9 || frame.bits_per_sample > 16)
      return damaged(fmt::format("JPEG-LS of {} components with {} bits", frame.component_count,
                                 frame.bits_per_sample));
    if (frame.width == 0 || frame.height == 0 || frame.width > 65536 || frame.height > 65536 ||
        1LL * frame.width * frame.height > max_image_samples)
      return damaged(fmt::format("JPEG-LS of {}x{}", frame.width, frame.height));
    cv::Mat image(static_cast<int>(frame.height), static_cast<int>(frame.width), CV_16UC1);
    decoder.decode(image.data, image.total() * image.elemSize());
    return image;
  } catch (const charls::jpegls_error& error) {
    return damaged(std::string("damaged JPEG-LS (") + error.what() + ")");
  }
}

}  // namespace orbitfuse
