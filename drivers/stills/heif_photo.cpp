// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/heif_photo.hpp"

#include <fmt/format.h>
#include <libheif/heif.h>

#include <array>
#include <cstddef>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/image/image_codec.hpp"
#include "core/image/transparency.hpp"

namespace orbitfuse {
namespace {

constexpr int widest_px = 16384;  ///< phones of 200 megapixels have 16320

template <auto release>
struct Released {
  template <class T>
  void operator()(T* object) const {
    release(object);
  }
};
using Context = std::unique_ptr<heif_context, Released<heif_context_free>>;
using Handle = std::unique_ptr<heif_image_handle, Released<heif_image_handle_release>>;
using Image = std::unique_ptr<heif_image, Released<heif_image_release>>;
using DecodingOptions =
    std::unique_ptr<heif_decoding_options, Released<heif_decoding_options_free>>;

struct Photo {
  Context context;
  Handle handle;
};

tl::unexpected<Error> damaged(const std::string& where, const heif_error& error) {
  std::string_view text = error.message ? error.message : "unknown";
  text = text.substr(0, text.find('\n'));  // some end in one
  return fail(ErrorKind::input, where, fmt::format("damaged HEIC ({})", text),
              "copy the file again");
}

Result<Photo> open(std::string_view bytes, const std::string& where) {
  Photo photo;
  photo.context.reset(heif_context_alloc());
  heif_context* context = photo.context.get();
  heif_context_set_maximum_image_size_limit(context, widest_px);
  heif_error error =
      heif_context_read_from_memory_without_copy(context, bytes.data(), bytes.size(), nullptr);
  if (error.code != heif_error_Ok) return damaged(where, error);
  const int images = heif_context_get_number_of_top_level_images(context);
  if (images != 1) {
    return fail(ErrorKind::input, where, fmt::format("HEIC of {} photos, one expected", images),
                "export the one that is meant as JPEG");
  }
  heif_image_handle* handle = nullptr;
  error = heif_context_get_primary_image_handle(context, &handle);
  photo.handle.reset(handle);
  if (error.code != heif_error_Ok) return damaged(where, error);
  return photo;
}

}  // namespace

bool is_heif(std::string_view bytes) {
  if (bytes.size() < 12 || bytes.substr(4, 4) != "ftyp") return false;
  constexpr std::array<std::string_view, 5> brands{"heic", "heix", "mif1", "heim", "heis"};
  for (const std::string_view brand : brands)
    if (bytes.substr(8, 4) == brand) return true;
  return false;
}

Result<cv::Mat> decode_heif(std::string_view bytes, const std::string& where, double* transparent) {
  ORBITFUSE_ASSIGN(const Photo photo, open(bytes, where));
  const int width = heif_image_handle_get_width(photo.handle.get()),
            height = heif_image_handle_get_height(photo.handle.get());
  if (width <= 0 || height <= 0 || 3LL * width * height > max_image_samples) {
    return fail(ErrorKind::input, where, fmt::format("HEIC of {}x{}", width, height),
                "copy the file again");
  }
  const DecodingOptions options(heif_decoding_options_alloc());
  options->convert_hdr_to_8bit = 1;
  options->strict_decoding = 1;
  const bool has_alpha = heif_image_handle_has_alpha_channel(photo.handle.get()) != 0;
  const int channels = has_alpha ? 4 : 3;
  heif_image* decoded = nullptr;
  const heif_error error = heif_decode_image(
      photo.handle.get(), &decoded, heif_colorspace_RGB,
      has_alpha ? heif_chroma_interleaved_RGBA : heif_chroma_interleaved_RGB, options.get());
  const Image image(decoded);
  if (error.code != heif_error_Ok) return damaged(where, error);
  int stride = 0;
  const std::uint8_t* plane =
      heif_image_get_plane_readonly(decoded, heif_channel_interleaved, &stride);
  const int columns = heif_image_get_width(decoded, heif_channel_interleaved),
            rows = heif_image_get_height(decoded, heif_channel_interleaved);
  if (!plane || columns <= 0 || rows <= 0 || stride < channels * columns) {
    return fail(ErrorKind::input, where, "HEIC without a picture", "copy the file again");
  }
  // What a file says and what its stream holds are two things: a kilobyte may unfold to gigabytes.
  if (columns != width || rows != height)
    return fail(ErrorKind::input, where,
                fmt::format("HEIC of {}x{} that holds {}x{}", width, height, columns, rows),
                "copy the file again");
  const cv::Mat stored(rows, columns, CV_8UC(channels), const_cast<std::uint8_t*>(plane),
                       static_cast<std::size_t>(stride));
  if (transparent) *transparent = has_alpha ? transparent_share(stored) : 0;
  cv::Mat bgr;
  cv::cvtColor(stored, bgr, has_alpha ? cv::COLOR_RGBA2BGR : cv::COLOR_RGB2BGR);
  return bgr;
}

ExifInfo heif_exif(std::string_view bytes) {
  const Result<Photo> photo = open(bytes, "");
  if (!photo) return {};
  const heif_image_handle* handle = photo->handle.get();
  heif_item_id id = 0;
  if (heif_image_handle_get_list_of_metadata_block_IDs(handle, "Exif", &id, 1) != 1) return {};
  // More is no camera's.
  constexpr std::size_t largest = std::size_t{16} << 20;
  const std::size_t size = heif_image_handle_get_metadata_size(handle, id);
  if (size < 4 || size > largest) return {};
  std::string block(size, '\0');
  if (heif_image_handle_get_metadata(handle, id, block.data()).code != heif_error_Ok) return {};
  // Four bytes say where the TIFF header is behind them (ISO/IEC 23008-12, A.2.1).
  std::size_t offset = 0;
  for (std::size_t i = 0; i < 4; ++i) offset = offset << 8 | static_cast<unsigned char>(block[i]);
  if (offset > size - 4) return {};
  ExifInfo info = read_exif(std::string_view(block).substr(4 + offset));
  info.orientation = 1;
  return info;
}

}  // namespace orbitfuse
