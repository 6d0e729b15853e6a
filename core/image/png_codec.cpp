// SPDX-License-Identifier: BSD-3-Clause
#include <png.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <vector>

#include <fmt/format.h>

#include "core/image/image_codec.hpp"
#include "core/image/transparency.hpp"

namespace orbitfuse {
namespace {

/// What libpng's callbacks share. By itself libpng prints to stderr, where no line names the file.
struct PngReader {
  std::string_view bytes;
  std::size_t at = 0;
  char text[128] = {};
  bool damaged = false;  ///< in the image data, though libpng goes on
  png_structp png = nullptr;
  png_infop info = nullptr;

  ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }
};

void keep(PngReader& reader, const char* message) {
  std::snprintf(reader.text, sizeof reader.text, "%s", message);
}

[[noreturn]] void on_error(png_structp png, png_const_charp message) {
  keep(*static_cast<PngReader*>(png_get_error_ptr(png)), message);
  png_longjmp(png, 1);
}

void on_warning(png_structp png, png_const_charp message) {
  // Encoders leave data over, and odd colour profiles; a checksum that is wrong is damage.
  if (std::strncmp(message, "IDAT", 4) != 0 || std::strstr(message, "xtra compressed") ||
      std::strstr(message, "Too much image data"))
    return;
  auto& reader = *static_cast<PngReader*>(png_get_error_ptr(png));
  keep(reader, message);
  reader.damaged = true;
}

void read_bytes(png_structp png, png_bytep to, std::size_t count) {
  auto& reader = *static_cast<PngReader*>(png_get_io_ptr(png));
  if (count > reader.bytes.size() - reader.at) png_error(png, "it ends early");
  std::memcpy(to, reader.bytes.data() + reader.at, count);
  reader.at += count;
}

enum class Alpha { dropped, kept };

/// Plain C style, like read_pixels(): longjmp may not pass over C++ objects.
bool read_header(PngReader& reader, Alpha alpha) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_set_read_fn(reader.png, &reader, read_bytes);
  // Sizes are checked against ours, not libpng's.
  png_set_user_limits(reader.png, 0x7fffffff, 0x7fffffff);
  png_read_info(reader.png, reader.info);
  png_set_expand(reader.png);  // palettes, transparent colours, grey of less than 8 bits
  if (alpha == Alpha::dropped) png_set_strip_alpha(reader.png);
  png_set_swap(reader.png);  // samples of 16 bits are big-endian
  png_set_bgr(reader.png);
  png_set_interlace_handling(reader.png);
  png_read_update_info(reader.png, reader.info);
  return true;
}

bool read_pixels(PngReader& reader, png_bytepp rows) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_read_image(reader.png, rows);
  png_read_end(reader.png, nullptr);
  return !reader.damaged;
}

std::uint32_t big_endian(std::string_view bytes) {
  std::uint32_t value = 0;
  for (const char c : bytes) value = value << 8 | static_cast<unsigned char>(c);
  return value;
}

/// Pictures that the file plays one after the other (acTL, before the image data); libpng reads the
/// first of them and says nothing.
std::uint32_t animation_frames(std::string_view bytes) {
  for (std::size_t at = 8; at + 16 <= bytes.size();) {
    const std::string_view kind = bytes.substr(at + 4, 4);
    if (kind == "acTL") return big_endian(bytes.substr(at + 8, 4));
    if (kind == "IDAT") break;
    at += std::size_t{12} + big_endian(bytes.substr(at, 4));
  }
  return 0;
}

Result<cv::Mat> decode(std::string_view bytes, const std::string& where, Alpha alpha) {
  PngReader reader;
  reader.bytes = bytes;
  reader.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &reader, on_error, on_warning);
  reader.info = reader.png ? png_create_info_struct(reader.png) : nullptr;
  const auto damaged = [&] {
    return fail(ErrorKind::input, where, fmt::format("truncated or damaged PNG ({})", reader.text),
                "copy the file again");
  };
  if (!reader.info || !read_header(reader, alpha)) return damaged();
  const std::uint64_t width = png_get_image_width(reader.png, reader.info);
  const std::uint64_t height = png_get_image_height(reader.png, reader.info);
  const int channels = png_get_channels(reader.png, reader.info);
  if (width > 65536 || height > 65536 ||
      width * height * static_cast<std::uint64_t>(channels) > std::uint64_t{max_image_samples}) {
    return fail(ErrorKind::input, where, fmt::format("PNG of {}x{}", width, height),
                "the header is damaged; copy the file again");
  }
  const int depth = png_get_bit_depth(reader.png, reader.info) == 16 ? CV_16U : CV_8U;
  cv::Mat image(static_cast<int>(height), static_cast<int>(width), CV_MAKETYPE(depth, channels));
  if (png_get_rowbytes(reader.png, reader.info) != image.step) return damaged();
  std::vector<png_bytep> rows(height);
  for (std::size_t y = 0; y < rows.size(); ++y) rows[y] = image.ptr(static_cast<int>(y));
  if (!read_pixels(reader, rows.data())) return damaged();
  return image;
}

}  // namespace

Result<cv::Mat> decode_png(std::string_view bytes, const std::string& where) {
  if (const std::uint32_t frames = animation_frames(bytes); frames > 1) {
    return fail(ErrorKind::input, where,
                fmt::format("animated PNG of {} frames, one expected", frames),
                "export the frame that is meant as a PNG of its own");
  }
  return decode(bytes, where, Alpha::dropped);
}

double png_transparent_share(std::string_view bytes) {
  // Most have none: their header is all that is read.
  PngReader reader;
  reader.bytes = bytes;
  reader.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &reader, on_error, on_warning);
  reader.info = reader.png ? png_create_info_struct(reader.png) : nullptr;
  if (!reader.info || !read_header(reader, Alpha::kept)) return 0;
  if (png_get_channels(reader.png, reader.info) % 2 != 0) return 0;
  const Result<cv::Mat> image = decode(bytes, {}, Alpha::kept);
  return image ? transparent_share(*image) : 0;
}

}  // namespace orbitfuse
