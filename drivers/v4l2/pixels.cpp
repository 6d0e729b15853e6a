// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/v4l2/pixels.hpp"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <opencv2/imgproc.hpp>

namespace orbitfuse::v4l2 {
namespace {

tl::unexpected<Error> damaged(const Layout& layout, std::string found) {
  return fail(ErrorKind::device, fourcc_text(layout.fourcc) + " frame", std::move(found),
              "counted as rejected");
}

/// Some cameras pad an MJPEG buffer with zeros after the end marker; anything else there is damage.
Status unpack_mjpeg(std::span<const std::uint8_t> bytes, const Layout& layout, Frame& frame) {
  if (bytes.size() < 4 || bytes[0] != 0xff || bytes[1] != 0xd8) {
    return damaged(layout, "no start-of-image marker");
  }
  std::size_t end = bytes.size();
  while (end > 2 && bytes[end - 1] == 0) --end;
  if (bytes[end - 2] != 0xff || bytes[end - 1] != 0xd9) {
    return damaged(layout, "no end-of-image marker: the frame is cut");
  }
  frame.encoded.assign(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(end));
  frame.extension = ".jpg";
  return {};
}

}  // namespace

std::string fourcc_text(std::uint32_t fourcc) {
  std::string text(4, ' ');
  for (std::size_t i = 0; i < 4; ++i) text[i] = static_cast<char>(fourcc >> (8 * i) & 0x7f);
  return text;
}

bool is_supported(std::uint32_t fourcc) {
  constexpr std::array<std::uint32_t, 6> known{V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG,
                                               V4L2_PIX_FMT_JPEG, V4L2_PIX_FMT_NV12,
                                               V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_Y16};
  return std::find(known.begin(), known.end(), fourcc) != known.end();
}

Status unpack(std::span<const std::uint8_t> bytes, const Layout& layout, Frame& frame) {
  if (layout.fourcc == V4L2_PIX_FMT_MJPEG || layout.fourcc == V4L2_PIX_FMT_JPEG) {
    return unpack_mjpeg(bytes, layout, frame);
  }
  if (!is_supported(layout.fourcc)) return damaged(layout, "a format that cannot be unpacked");
  const bool nv12 = layout.fourcc == V4L2_PIX_FMT_NV12;
  const bool one_byte = nv12 || layout.fourcc == V4L2_PIX_FMT_GREY;
  const int row_bytes = layout.width * (one_byte ? 1 : 2);
  const auto stride = static_cast<std::size_t>(std::max(layout.bytes_per_line, row_bytes));
  const int rows = nv12 ? layout.height * 3 / 2 : layout.height;
  // The last row may come without its padding.
  const std::size_t needed =
      stride * static_cast<std::size_t>(rows - 1) + static_cast<std::size_t>(row_bytes);
  if (layout.width <= 0 || layout.height <= 0 || bytes.size() < needed) {
    return damaged(layout, fmt::format("{} bytes, {} needed for {}x{}", bytes.size(), needed,
                                       layout.width, layout.height));
  }
  // What only a broken driver says; the conversions below would end the program over it.
  const bool whole_samples = layout.fourcc != V4L2_PIX_FMT_Y16 || stride % 2 == 0;
  const bool whole_colors = layout.fourcc == V4L2_PIX_FMT_GREY ||
                            layout.fourcc == V4L2_PIX_FMT_Y16 ||
                            (layout.width % 2 == 0 && (!nv12 || layout.height % 2 == 0));
  if (!whole_samples || !whole_colors) {
    return damaged(layout, fmt::format("{}x{} with {} bytes a row", layout.width, layout.height,
                                       layout.bytes_per_line));
  }
  auto* data = const_cast<std::uint8_t*>(bytes.data());  // cv::Mat has no const view; only read
  const auto view = [&](int type) { return cv::Mat(rows, layout.width, type, data, stride); };
  switch (layout.fourcc) {
    case V4L2_PIX_FMT_YUYV:
      cv::cvtColor(view(CV_8UC2), frame.pixels, cv::COLOR_YUV2BGR_YUYV);
      break;
    case V4L2_PIX_FMT_NV12:
      cv::cvtColor(view(CV_8UC1), frame.pixels, cv::COLOR_YUV2BGR_NV12);
      break;
    case V4L2_PIX_FMT_GREY:
      frame.pixels = view(CV_8UC1).clone();
      break;
    default:
      frame.pixels = view(CV_16UC1).clone();
  }
  return {};
}

}  // namespace orbitfuse::v4l2
