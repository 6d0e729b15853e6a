// SPDX-License-Identifier: BSD-3-Clause
#include "core/image/tiff_layout.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

namespace orbitfuse {
namespace {

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

/// Of an element without content ("<GDALMetadata/>") there is no end tag.
bool is_cut(const std::string& metadata) {
  const std::size_t first_end = metadata.find('>');
  if (first_end == metadata.npos) return true;
  return metadata[first_end - 1] != '/' && metadata.find("</GDALMetadata") == metadata.npos;
}

constexpr const char* no_number = "\"no number (GDAL's metadata)\"";

/// The number of an item of that role as JSON; text where it is no number, for whoever reads it
/// names it.
std::string gdal_number(const std::string& metadata, const std::string& role, const char* missing) {
  const std::size_t at = metadata.find("role=\"" + role + "\"");
  if (at == metadata.npos) return missing;
  const std::size_t begin = metadata.find('>', at);
  if (begin == metadata.npos) return no_number;
  double number = 0;
  const char* from = metadata.data() + begin + 1;
  const char* to = metadata.data() + metadata.size();
  const auto [end, error] = std::from_chars(from, to, number);
  if (error != std::errc() || end == to || *end != '<' || !std::isfinite(number)) return no_number;
  return fmt::format("{}", number);
}

/// The text of GDAL's item of the unit (UNITTYPE), empty without one.
std::string gdal_unit(const std::string& metadata) {
  const std::size_t at = metadata.find("role=\"unittype\"");
  const std::size_t begin = at == metadata.npos ? at : metadata.find('>', at);
  if (begin == metadata.npos) return {};
  return metadata.substr(begin + 1, metadata.find('<', begin) - begin - 1);
}

}  // namespace

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

bool alike(const TiffLayout& a, const TiffLayout& b) {
  return a.width == b.width && a.height == b.height && a.bits == b.bits &&
         a.channels == b.channels && a.format == b.format;
}

std::optional<int> depth_of(const TiffLayout& l) {
  if (l.format == SAMPLEFORMAT_IEEEFP && l.bits == 32) return CV_32F;
  if (l.format == SAMPLEFORMAT_IEEEFP && l.bits == 64) return CV_64F;
  if (l.format == SAMPLEFORMAT_UINT && l.bits == 16) return CV_16U;
  if (l.format == SAMPLEFORMAT_UINT && l.bits == 8) return CV_8U;
  return std::nullopt;
}

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

bool is_copy(TIFF* tiff) {
  std::uint32_t kind = 0;
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SUBFILETYPE, &kind);
  return (kind & (FILETYPE_REDUCEDIMAGE | FILETYPE_MASK)) != 0;
}

bool has_alpha(TIFF* tiff) {
  std::uint16_t count = 0;
  const std::uint16_t* kinds = nullptr;
  TIFFGetFieldDefaulted(tiff, TIFFTAG_EXTRASAMPLES, &count, &kinds);
  return count == 1 && (kinds[0] == EXTRASAMPLE_ASSOCALPHA || kinds[0] == EXTRASAMPLE_UNASSALPHA);
}

std::string misplaced_samples(TIFF* tiff) {
  const std::uint64_t header_bytes = TIFFIsBigTIFF(tiff) ? 16 : 8;
  const bool tiled = TIFFIsTiled(tiff) != 0;
  const std::uint32_t parts = tiled ? TIFFNumberOfTiles(tiff) : TIFFNumberOfStrips(tiff);
  for (std::uint32_t part = 0; part < parts; ++part) {
    int unknown = 0;  // reading will fail there
    const std::uint64_t at = TIFFGetStrileOffsetWithErr(tiff, part, &unknown);
    if (unknown) return {};
    if (at < header_bytes && TIFFGetStrileByteCount(tiff, part) > 0)
      return fmt::format("{} {} of its samples begins at byte {}, in the file's header",
                         tiled ? "tile" : "strip", part + 1, at);
  }
  return {};
}

std::string description_of(TIFF* tiff) {
  const char* text = nullptr;
  std::string description;
  if (TIFFGetField(tiff, TIFFTAG_IMAGEDESCRIPTION, &text) && text) description = text;
  const std::string metadata = gdal_metadata(tiff);
  if (description.find("\"scale\"") != description.npos) return description;
  // Whether a scale or an offset stood in the rest nobody knows.
  if (metadata.starts_with("<GDALMetadata") && is_cut(metadata))
    return R"({"scale":"GDAL's metadata, cut off"})";
  const std::string unit = gdal_unit(metadata);
  const std::string named =
      unit.empty() ? ""
                   : "\"unit\":" + nlohmann::json(unit).dump(
                                       -1, ' ', false, nlohmann::json::error_handler_t::replace);
  if (metadata.find("role=\"scale\"") == metadata.npos) {
    const bool says_less = !unit.empty() && description.find("\"unit\"") == description.npos;
    return says_less ? "{" + named + "}" : description;
  }
  return fmt::format(R"({{"scale":{},"offset":{}{}{}}})", gdal_number(metadata, "scale", "1"),
                     gdal_number(metadata, "offset", "0"), unit.empty() ? "" : ",", named);
}

}  // namespace orbitfuse
