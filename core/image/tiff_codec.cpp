// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tiffio.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdarg>
#include <cstring>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "core/image/image_codec.hpp"
#include "core/image/transparency.hpp"

namespace orbitfuse {
namespace {

/// A TIFF in memory; libtiff reads and writes it through the callbacks below.
struct MemoryFile {
  std::string_view input;
  std::string output;
  bool writing = false;
  bool tag_is_cut = false;  ///< a tag's value lies beyond the end of the file
  toff_t position = 0;

  toff_t size() const { return writing ? output.size() : input.size(); }
};

tmsize_t read_bytes(thandle_t handle, void* to, tmsize_t count) {
  auto& file = *static_cast<MemoryFile*>(handle);
  const char* from = file.writing ? file.output.data() : file.input.data();
  if (count <= 0 || file.position >= file.size()) return 0;
  const auto n = std::min<toff_t>(static_cast<toff_t>(count), file.size() - file.position);
  std::memcpy(to, from + file.position, n);
  file.position += n;
  return static_cast<tmsize_t>(n);
}

tmsize_t write_bytes(thandle_t handle, void* from, tmsize_t count) {
  auto& file = *static_cast<MemoryFile*>(handle);
  const auto n = static_cast<toff_t>(count);
  if (file.position + n > file.output.size()) file.output.resize(file.position + n);
  std::memcpy(file.output.data() + file.position, from, n);
  file.position += n;
  return count;
}

toff_t seek(thandle_t handle, toff_t offset, int whence) {
  auto& file = *static_cast<MemoryFile*>(handle);
  const toff_t base = whence == SEEK_SET ? 0 : whence == SEEK_CUR ? file.position : file.size();
  return file.position = base + offset;
}

int close_nothing(thandle_t) { return 0; }
toff_t size_of(thandle_t handle) { return static_cast<MemoryFile*>(handle)->size(); }
int map_nothing(thandle_t, void**, toff_t*) { return 0; }
void unmap_nothing(thandle_t, void*, toff_t) {}

/// libtiff leaves out tags that it can't read and goes on; only its warning tells.
void on_warning(thandle_t handle, const char*, const char* format, va_list) {
  if (handle && std::strstr(format, "IO error"))
    static_cast<MemoryFile*>(handle)->tag_is_cut = true;
}

constexpr int max_pages = 10000;  // a recording; a damaged chain of directories ends here

using TiffHandle = std::unique_ptr<TIFF, decltype(&TIFFClose)>;

TiffHandle open(MemoryFile& file, const char* mode) {
  // libtiff prints to stderr by default; failures are reported by return values here.
  static const bool quiet = [] {
    TIFFSetErrorHandler(nullptr);
    TIFFSetWarningHandler(nullptr);
    TIFFSetWarningHandlerExt(on_warning);
    return true;
  }();
  (void)quiet;
  return {TIFFClientOpen("memory", mode, &file, read_bytes, write_bytes, seek, close_nothing,
                         size_of, map_nothing, unmap_nothing),
          &TIFFClose};
}

struct TiffLayout {
  std::uint32_t width = 0, height = 0;
  std::uint16_t bits = 1, channels = 1, format = SAMPLEFORMAT_UINT, planar = PLANARCONFIG_CONTIG;
  std::uint16_t photometric = PHOTOMETRIC_MINISBLACK, compression = COMPRESSION_NONE;
};

TiffLayout layout_of(TIFF* tiff) {
  TiffLayout l;
  TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &l.width);
  TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &l.height);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &l.bits);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &l.channels);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLEFORMAT, &l.format);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_PLANARCONFIG, &l.planar);
  TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &l.photometric);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_COMPRESSION, &l.compression);
  return l;
}

/// OpenCV's; nothing for samples that are not read.
std::optional<int> depth_of(const TiffLayout& l) {
  if (l.format == SAMPLEFORMAT_IEEEFP && l.bits == 32) return CV_32F;
  if (l.format == SAMPLEFORMAT_UINT && l.bits == 16) return CV_16U;
  if (l.format == SAMPLEFORMAT_UINT && l.bits == 8) return CV_8U;
  return std::nullopt;
}

/// Colours that would be taken for others; null: those that are read.
const char* unread_colors(const TiffLayout& l) {
  switch (l.photometric) {
    case PHOTOMETRIC_MINISBLACK:
    case PHOTOMETRIC_RGB:
      return nullptr;
    case PHOTOMETRIC_MINISWHITE:  // of counts nobody knows from where they are to be turned
      return l.bits == 8 && l.channels == 1 ? nullptr : "0 is white (MINISWHITE)";
    case PHOTOMETRIC_YCBCR:  // libtiff turns those of JPEG into RGB
      return l.compression == COMPRESSION_JPEG ? nullptr : "YCbCr without JPEG";
    case PHOTOMETRIC_PALETTE:
      return "a palette";
    case PHOTOMETRIC_SEPARATED:
      return "CMYK";
    case PHOTOMETRIC_CIELAB:
    case PHOTOMETRIC_ICCLAB:
    case PHOTOMETRIC_ITULAB:
      return "Lab";
    case PHOTOMETRIC_MASK:
      return "a mask";
    default:
      return "colours of an unknown kind";
  }
}

/// Why it can't be read; empty where it can.
std::string unread_layout(const TiffLayout& l) {
  std::string why;
  if (const char* colors = unread_colors(l)) {
    why = colors;
  } else if (l.planar != PLANARCONFIG_CONTIG && l.channels > 1) {
    why = "each colour in a plane of its own (planar)";
  } else if (depth_of(l) && l.channels >= 1 && l.channels <= 4) {
    return {};
  }
  const char* kind = l.format == SAMPLEFORMAT_INT      ? "signed "
                     : l.format == SAMPLEFORMAT_IEEEFP ? "float "
                                                       : "";
  return fmt::format("TIFF with {}-bit {}samples, {} channels{}{}", l.bits, kind, l.channels,
                     why.empty() ? "" : ": ", why);
}

/// GDAL's words of the samples: <Item name="SCALE" sample="0" role="scale">0.04</Item>.
constexpr std::uint32_t gdal_metadata_tag = 42112;

std::string gdal_metadata(TIFF* tiff) {
  const TIFFField* field = TIFFFindField(tiff, gdal_metadata_tag, TIFF_ANY);
  std::uint32_t count = 0;
  const char* text = nullptr;
  if (!field || TIFFFieldDataType(field) != TIFF_ASCII || !TIFFFieldPassCount(field) ||
      TIFFFieldReadCount(field) != TIFF_VARIABLE2)
    return {};
  if (!TIFFGetField(tiff, gdal_metadata_tag, &count, &text) || !text) return {};
  return {text, ::strnlen(text, count)};
}

/// The number of an item of that role as JSON; text where it is no number, for whoever reads it
/// names it.
std::string gdal_number(const std::string& metadata, const std::string& role, const char* missing) {
  const std::size_t at = metadata.find("role=\"" + role + "\"");
  const std::size_t begin = at == metadata.npos ? at : metadata.find('>', at);
  if (begin == metadata.npos) return missing;
  double number = 0;
  const char* from = metadata.data() + begin + 1;
  const char* to = metadata.data() + metadata.size();
  const auto [end, error] = std::from_chars(from, to, number);
  if (error != std::errc() || end == to || *end != '<' || !std::isfinite(number))
    return "\"no number (GDAL's metadata)\"";
  return fmt::format("{}", number);
}

/// What the samples mean: the ImageDescription, or GDAL's scale in the words of our own tag.
std::string description_of(TIFF* tiff) {
  const char* text = nullptr;
  std::string description;
  if (TIFFGetField(tiff, TIFFTAG_IMAGEDESCRIPTION, &text) && text) description = text;
  const std::string metadata = gdal_metadata(tiff);
  if (metadata.find("role=\"scale\"") == metadata.npos ||
      description.find("\"scale\"") != description.npos)
    return description;
  return fmt::format(R"({{"scale":{},"offset":{}}})", gdal_number(metadata, "scale", "1"),
                     gdal_number(metadata, "offset", "0"));
}

bool read_strips(TIFF* tiff, const TiffLayout& l, cv::Mat& image) {
  const auto row_bytes = static_cast<std::size_t>(l.width) * image.elemSize();
  if (static_cast<std::size_t>(TIFFScanlineSize(tiff)) != row_bytes) return false;
  for (std::uint32_t y = 0; y < l.height; ++y) {
    if (TIFFReadScanline(tiff, image.ptr(static_cast<int>(y)), y, 0) < 0) return false;
  }
  return true;
}

bool read_tiles(TIFF* tiff, const TiffLayout& l, cv::Mat& image) {
  std::uint32_t tile_w = 0, tile_h = 0;
  TIFFGetField(tiff, TIFFTAG_TILEWIDTH, &tile_w);
  TIFFGetField(tiff, TIFFTAG_TILELENGTH, &tile_h);
  const std::size_t row_bytes = static_cast<std::size_t>(tile_w) * image.elemSize();
  if (tile_w == 0 || tile_h == 0 || tile_w > 65536 || tile_h > 65536 ||
      static_cast<std::size_t>(TIFFTileSize(tiff)) != row_bytes * tile_h) {
    return false;
  }
  std::vector<unsigned char> tile(row_bytes * tile_h);
  for (std::uint32_t y = 0; y < l.height; y += tile_h) {
    for (std::uint32_t x = 0; x < l.width; x += tile_w) {
      if (TIFFReadTile(tiff, tile.data(), x, y, 0, 0) < 0) return false;
      const std::size_t n = std::min(tile_w, l.width - x) * image.elemSize();
      for (std::uint32_t r = 0; r < std::min(tile_h, l.height - y); ++r) {
        std::memcpy(image.ptr(static_cast<int>(y + r)) + x * image.elemSize(),
                    tile.data() + r * row_bytes, n);
      }
    }
  }
  return true;
}

/// A mask, or a reduced copy of another image.
bool is_copy(TIFF* tiff) {
  std::uint32_t kind = 0;
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SUBFILETYPE, &kind);
  return (kind & (FILETYPE_REDUCEDIMAGE | FILETYPE_MASK)) != 0;
}

bool alike(const TiffLayout& a, const TiffLayout& b) {
  return a.width == b.width && a.height == b.height && a.bits == b.bits &&
         a.channels == b.channels && a.format == b.format;
}

/// To the first image: some programs put a reduced copy before it. Of copies alone the first.
void to_first_page(TIFF* tiff) {
  while (is_copy(tiff))
    if (TIFFReadDirectory(tiff) != 1) {
      TIFFSetDirectory(tiff, 0);
      return;
    }
}

/// Advances to the next image of the first one's layout.
bool next_page(TIFF* tiff, const TiffLayout& first) {
  while (TIFFReadDirectory(tiff) == 1)
    if (alike(layout_of(tiff), first) && !is_copy(tiff)) return true;
  return false;
}

cv::Mat to_bgr(const cv::Mat& image) {
  cv::Mat out = image;
  if (image.channels() == 3) cv::cvtColor(image, out, cv::COLOR_RGB2BGR);
  if (image.channels() == 4) cv::cvtColor(image, out, cv::COLOR_RGBA2BGR);
  if (image.channels() == 2) cv::extractChannel(image, out, 0);
  return out;
}

/// Whether the last channel says how much can be seen through; others may be infrared, or anything.
bool has_alpha(TIFF* tiff) {
  std::uint16_t count = 0;
  const std::uint16_t* kinds = nullptr;
  TIFFGetFieldDefaulted(tiff, TIFFTAG_EXTRASAMPLES, &count, &kinds);
  return count == 1 && (kinds[0] == EXTRASAMPLE_ASSOCALPHA || kinds[0] == EXTRASAMPLE_UNASSALPHA);
}

struct StoredPage {
  TiffLayout layout;
  cv::Mat samples;  ///< all channels, as they are stored
};

Result<StoredPage> read_page(std::string_view bytes, const std::string& where,
                             std::string* image_description, int page) {
  MemoryFile file;
  file.input = bytes;
  const TiffHandle tiff = open(file, "rm");
  if (!tiff) return fail(ErrorKind::input, where, "not a readable TIFF", "copy the file again");
  to_first_page(tiff.get());
  TiffLayout l = layout_of(tiff.get());
  for (int at = 0; at < page; ++at) {
    if (!next_page(tiff.get(), l))
      return fail(ErrorKind::input, where, fmt::format("no page {}", page + 1),
                  "copy the file again");
  }
  l = layout_of(tiff.get());  // of the page
  if (std::string why = unread_layout(l); !why.empty()) {
    return fail(ErrorKind::input, where, std::move(why),
                "convert it to 8 or 16-bit unsigned grey or RGB");
  }
  if (l.photometric == PHOTOMETRIC_YCBCR)
    TIFFSetField(tiff.get(), TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
  const long long samples = 1LL * l.width * l.height * l.channels;
  if (l.width == 0 || l.height == 0 || l.width > 65536 || l.height > 65536 ||
      samples > max_image_samples) {
    return fail(ErrorKind::input, where, fmt::format("TIFF of {}x{}", l.width, l.height),
                "the header is damaged; copy the file again");
  }
  if (image_description) {
    if (std::string text = description_of(tiff.get()); !text.empty())
      *image_description = std::move(text);
  }
  cv::Mat image(static_cast<int>(l.height), static_cast<int>(l.width),
                CV_MAKETYPE(*depth_of(l), l.channels));
  const bool whole = TIFFIsTiled(tiff.get()) ? read_tiles(tiff.get(), l, image)
                                             : read_strips(tiff.get(), l, image);
  if (!whole || file.tag_is_cut) {
    return fail(ErrorKind::input, where, "truncated or damaged TIFF", "copy the file again");
  }
  return StoredPage{l, image};
}

}  // namespace

std::optional<int> tiff_page_count(std::string_view bytes) {
  MemoryFile file;
  file.input = bytes;
  const TiffHandle tiff = open(file, "rm");
  if (!tiff) return std::nullopt;
  to_first_page(tiff.get());
  const TiffLayout first = layout_of(tiff.get());
  int pages = 1;
  while (pages < max_pages && next_page(tiff.get(), first)) ++pages;
  return pages;
}

std::string other_tiff_pages(std::string_view bytes) {
  MemoryFile file;
  file.input = bytes;
  const TiffHandle tiff = open(file, "rm");
  if (!tiff) return {};
  to_first_page(tiff.get());
  const TiffLayout first = layout_of(tiff.get());
  constexpr std::size_t named = 3;
  std::vector<std::string> others;
  std::size_t count = 0;
  // The number is the directory's, by which other programs know it too.
  for (int page = TIFFCurrentDirectory(tiff.get()) + 2;
       page <= max_pages && TIFFReadDirectory(tiff.get()) == 1; ++page) {
    const TiffLayout l = layout_of(tiff.get());
    if (is_copy(tiff.get()) || alike(l, first)) continue;
    if (++count <= named)
      others.push_back(fmt::format("{} ({}x{}, {}-bit{})", page, l.width, l.height, l.bits,
                                   l.channels > 1 ? fmt::format(", {} channels", l.channels) : ""));
  }
  if (others.empty()) return {};
  return fmt::format(
      "page{} {}{}, of another size or kind than the first: previews, or another camera's images; "
      "split the file (tiffsplit) to use them",
      count > 1 ? "s" : "", fmt::join(others, ", "),
      count > named ? fmt::format(" and {} more", count - named) : "");
}

Result<cv::Mat> decode_tiff(std::string_view bytes, const std::string& where,
                            std::string* image_description, std::optional<int> page) {
  if (!page) {
    if (const int pages = tiff_page_count(bytes).value_or(1); pages > 1) {
      return fail(ErrorKind::input, where, fmt::format("TIFF of {} pages, one expected", pages),
                  "split it (tiffsplit), or import its pages as thermal frames");
    }
  }
  ORBITFUSE_ASSIGN(StoredPage stored, read_page(bytes, where, image_description, page.value_or(0)));
  if (stored.layout.photometric == PHOTOMETRIC_MINISWHITE) stored.samples = 255 - stored.samples;
  return to_bgr(stored.samples);
}

double tiff_transparent_share(std::string_view bytes, std::optional<int> page) {
  // Most have no alpha: their first image's directory is all that is read.
  MemoryFile file;
  file.input = bytes;
  const TiffHandle tiff = open(file, "rm");
  if (tiff) to_first_page(tiff.get());
  if (!tiff || layout_of(tiff.get()).channels % 2 != 0 || !has_alpha(tiff.get())) return 0;
  const auto stored = read_page(bytes, {}, nullptr, page.value_or(0));
  return stored && stored->samples.depth() != CV_32F ? transparent_share(stored->samples) : 0;
}

Result<std::string> encode_tiff(const cv::Mat& image, const std::string& image_description) {
  CV_Assert(image.type() == CV_16UC1 || image.type() == CV_32FC1);
  const bool is_float = image.type() == CV_32FC1;
  MemoryFile file;
  file.writing = true;
  {
    const TiffHandle tiff = open(file, "wm");
    if (!tiff) return fail(ErrorKind::device, "TIFF", "encoder failed", "report this");
    TIFFSetField(tiff.get(), TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(image.cols));
    TIFFSetField(tiff.get(), TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(image.rows));
    TIFFSetField(tiff.get(), TIFFTAG_BITSPERSAMPLE, is_float ? 32 : 16);
    TIFFSetField(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(tiff.get(), TIFFTAG_SAMPLEFORMAT,
                 is_float ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
    TIFFSetField(tiff.get(), TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff.get(), TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(tiff.get(), TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);
    TIFFSetField(tiff.get(), TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
    TIFFSetField(tiff.get(), TIFFTAG_PREDICTOR,
                 is_float ? PREDICTOR_FLOATINGPOINT : PREDICTOR_HORIZONTAL);
    TIFFSetField(tiff.get(), TIFFTAG_ROWSPERSTRIP, static_cast<std::uint32_t>(image.rows));
    TIFFSetField(tiff.get(), TIFFTAG_SOFTWARE, "OrbitFuse");
    if (!image_description.empty()) {
      TIFFSetField(tiff.get(), TIFFTAG_IMAGEDESCRIPTION, image_description.c_str());
    }
    cv::Mat row;
    for (int y = 0; y < image.rows; ++y) {
      image.row(y).copyTo(row);  // the predictor works in place on the row it is given
      if (TIFFWriteScanline(tiff.get(), row.data, static_cast<std::uint32_t>(y), 0) < 0) {
        return fail(ErrorKind::device, "TIFF", "encoder failed", "report this");
      }
    }
  }
  return std::move(file.output);
}

}  // namespace orbitfuse
