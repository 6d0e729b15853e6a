// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "core/first_names.hpp"
#include "core/image/image_codec.hpp"
#include "core/image/temperature_unit.hpp"
#include "core/image/tiff_file.hpp"
#include "core/image/tiff_layout.hpp"
#include "core/image/transparency.hpp"

namespace orbitfuse {
namespace {

constexpr int max_pages = 10000;  // a recording; a damaged chain of directories ends here

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

/// To the first image: some programs put a reduced copy before it. Of copies alone the first.
void to_first_page(TIFF* tiff) {
  while (is_copy(tiff))
    if (TIFFReadDirectory(tiff) != 1) {
      TIFFSetDirectory(tiff, 0);
      return;
    }
}

enum class Chain { goes_on, ends, breaks_off };

/// libtiff's "no further page" is also its answer to a link that leads nowhere.
Chain next_directory(TIFF* tiff) {
  if (TIFFLastDirectory(tiff)) return Chain::ends;
  return TIFFReadDirectory(tiff) == 1 ? Chain::goes_on : Chain::breaks_off;
}

/// Advances to the next image of the first one's layout.
bool next_page(TIFF* tiff, const TiffLayout& first) {
  while (next_directory(tiff) == Chain::goes_on)
    if (alike(layout_of(tiff), first) && !is_copy(tiff)) return true;
  return false;
}

/// What a page says of its samples' scale or unit, else what the first does: programs write it once
/// for the whole file. A page's unit alone (GDAL writes it for each) does not undo the first's
/// scale, unless it is another unit.
std::string description_of_page(std::string own, const std::string& firsts) {
  const auto names = [](const std::string& text, const char* key) {
    return text.find(key) != text.npos;
  };
  constexpr const char* scale = "\"scale\"";
  constexpr const char* unit = "\"unit\"";
  if (names(own, scale)) return own;
  if (!names(own, unit)) return names(firsts, scale) || names(firsts, unit) ? firsts : own;
  if (!names(firsts, scale)) return own;
  // A scale's unit is kelvin where it names none.
  const std::optional<TemperatureUnit> of_first =
      names(firsts, unit) ? temperature_unit_of(firsts) : TemperatureUnit::kelvin;
  return temperature_unit_of(own) == of_first ? firsts : own;
}

std::string remedy_of(const TiffLayout& l) {
  return depth_of(l) ? "convert it to 8 or 16-bit unsigned grey or RGB"
                     : "convert it: temperatures to 32-bit floats (kelvin or Celsius) or to 16-bit "
                       "unsigned (100 x kelvin), photos to 8-bit grey or RGB";
}

/// A TIFF in memory, at its first image until it is moved on.
class TiffPages {
 public:
  explicit TiffPages(std::string_view bytes) {
    file_.input = bytes;
    tiff_ = open_tiff(file_);
    if (!tiff_) return;
    to_first_page(get());
    first_ = layout_of(get());
  }

  explicit operator bool() const { return tiff_ != nullptr; }
  TIFF* get() const { return tiff_.get(); }
  const TiffLayout& first() const { return first_; }
  bool tag_is_cut() const { return file_.tag_is_cut; }

  bool next() { return next_page(get(), first_); }
  /// From the first.
  bool go_to(int page) {
    for (int at = 0; at < page; ++at)
      if (!next()) return false;
    return true;
  }

 private:
  TiffMemory file_;
  TiffHandle tiff_{nullptr, &TIFFClose};  // reads file_, so it goes first
  TiffLayout first_;
};

cv::Mat to_bgr(const cv::Mat& image) {
  cv::Mat out = image;
  if (image.channels() == 3) cv::cvtColor(image, out, cv::COLOR_RGB2BGR);
  if (image.channels() == 4) cv::cvtColor(image, out, cv::COLOR_RGBA2BGR);
  if (image.channels() == 2) cv::extractChannel(image, out, 0);
  return out;
}

struct StoredPage {
  TiffLayout layout;
  cv::Mat samples;  ///< all channels, as they are stored
};

Result<StoredPage> read_page(std::string_view bytes, const std::string& where,
                             std::string* image_description, int page) {
  TiffPages tiff(bytes);
  if (!tiff) return fail(ErrorKind::input, where, "not a readable TIFF", "copy the file again");
  const std::string firsts = image_description && page > 0 ? description_of(tiff.get()) : "";
  if (!tiff.go_to(page))
    return fail(ErrorKind::input, where, fmt::format("no page {}", page + 1),
                "copy the file again");
  const TiffLayout l = layout_of(tiff.get());
  if (std::string why = unread_layout(l); !why.empty())
    return fail(ErrorKind::input, where, std::move(why), remedy_of(l));
  if (l.channels == 2 && !has_alpha(tiff.get()))
    return fail(ErrorKind::input, where,
                "TIFF with 2 samples a pixel, of which none is called alpha: nothing says which is "
                "meant",
                "write the band that is meant into a TIFF of its own (gdal_translate -b 1)");
  if (l.photometric == PHOTOMETRIC_YCBCR)
    TIFFSetField(tiff.get(), TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
  const long long samples = 1LL * l.width * l.height * l.channels;
  if (l.width == 0 || l.height == 0 || l.width > 65536 || l.height > 65536 ||
      samples > max_image_samples) {
    return fail(ErrorKind::input, where, fmt::format("TIFF of {}x{}", l.width, l.height),
                "the header is damaged; copy the file again");
  }
  // libtiff reads the header's bytes as samples.
  if (std::string why = misplaced_samples(tiff.get()); !why.empty())
    return fail(ErrorKind::input, where, std::move(why),
                "its tags are damaged: copy or export the file again");
  if (image_description) {
    if (std::string text = description_of_page(description_of(tiff.get()), firsts); !text.empty())
      *image_description = std::move(text);
  }
  cv::Mat image(static_cast<int>(l.height), static_cast<int>(l.width),
                CV_MAKETYPE(*depth_of(l), l.channels));
  const bool whole = TIFFIsTiled(tiff.get()) ? read_tiles(tiff.get(), l, image)
                                             : read_strips(tiff.get(), l, image);
  if (!whole || tiff.tag_is_cut()) {
    return fail(ErrorKind::input, where, "truncated or damaged TIFF", "copy the file again");
  }
  // Nothing is measured to more digits than 32 bits hold.
  if (image.depth() == CV_64F) image.convertTo(image, CV_32F);
  return StoredPage{l, image};
}

}  // namespace

std::optional<int> tiff_page_count(std::string_view bytes) {
  TiffPages tiff(bytes);
  if (!tiff) return std::nullopt;
  int pages = 1;
  while (pages < max_pages && tiff.next()) ++pages;
  return pages;
}

std::optional<int> tiff_orientation(std::string_view bytes, std::optional<int> page) {
  TiffPages tiff(bytes);
  if (!tiff || !tiff.go_to(page.value_or(0))) return std::nullopt;
  std::uint16_t orientation = ORIENTATION_TOPLEFT;
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_ORIENTATION, &orientation);
  return orientation >= 1 && orientation <= 8 ? orientation : 1;
}

std::string other_tiff_pages(std::string_view bytes) {
  const TiffPages tiff(bytes);
  if (!tiff) return {};
  std::vector<std::string> others;
  Chain chain = Chain::ends;
  // The number is the directory's, by which other programs know it too.
  int page = TIFFCurrentDirectory(tiff.get()) + 2;
  for (; page <= max_pages; ++page) {
    chain = next_directory(tiff.get());
    if (chain != Chain::goes_on) break;
    const TiffLayout l = layout_of(tiff.get());
    if (is_copy(tiff.get()) || alike(l, tiff.first())) continue;
    others.push_back(fmt::format("{} ({}x{}, {}-bit{})", page, l.width, l.height, l.bits,
                                 l.channels > 1 ? fmt::format(", {} channels", l.channels) : ""));
  }
  std::string words;
  if (!others.empty())
    words = fmt::format(
        "page{} {}, of another size or kind than the first: previews, or another camera's images; "
        "split the file (tiffsplit) to use them",
        others.size() > 1 ? "s" : "", first_names(others, 3));
  if (chain == Chain::breaks_off)
    words += fmt::format(
        "{}all pages from {} on: the link to it leads nowhere (the file is cut or damaged); copy "
        "the file again",
        words.empty() ? "" : ". And ", page);
  return words;
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
  const TiffPages tiff(bytes);
  if (!tiff || tiff.first().channels % 2 != 0 || !has_alpha(tiff.get())) return 0;
  const auto stored = read_page(bytes, {}, nullptr, page.value_or(0));
  return stored && stored->samples.depth() != CV_32F ? transparent_share(stored->samples) : 0;
}

Result<std::string> encode_tiff(const cv::Mat& image, const std::string& image_description) {
  CV_Assert(image.type() == CV_16UC1 || image.type() == CV_32FC1);
  const bool is_float = image.type() == CV_32FC1;
  TiffMemory file;
  {
    const TiffHandle tiff = create_tiff(file);
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
