// SPDX-License-Identifier: BSD-3-Clause
#include "core/image/exif.hpp"

#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exiv2/exiv2.hpp>
#include <mutex>

#include "core/image/image_codec.hpp"

namespace orbitfuse {
namespace {

/// Of lenses for photos, from circular fisheyes to telescopes.
constexpr double shortest_35mm = 4, longest_35mm = 5000;

std::string text_of(const Exiv2::ExifData& data, const char* key) {
  const auto it = data.findKey(Exiv2::ExifKey(key));
  if (it == data.end()) return {};
  std::string text = it->toString();
  while (!text.empty() &&
         (text.back() == '\0' || std::isspace(static_cast<unsigned char>(text.back())))) {
    text.pop_back();
  }
  return text;
}

std::optional<double> number_of(const Exiv2::ExifData& data, const char* key) {
  const auto it = data.findKey(Exiv2::ExifKey(key));
  if (it == data.end() || it->count() < 1) return std::nullopt;
  const double value = static_cast<double>(it->toFloat());
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

/// "+02:00" in seconds; nothing for what no place on earth has.
std::optional<std::int64_t> offset_s(const std::string& offset) {
  char sign = 0;
  unsigned hours = 0, minutes = 0;
  if (std::sscanf(offset.c_str(), "%c%2u:%2u", &sign, &hours, &minutes) != 3 ||
      (sign != '+' && sign != '-') || hours > 14 || minutes > 59)
    return std::nullopt;
  const std::int64_t seconds = hours * 3600LL + minutes * 60LL;
  return sign == '+' ? seconds : -seconds;
}

/// "2021:06:30 10:20:30", ".123" digits and the offset to UTC nanoseconds.
std::optional<std::int64_t> epoch_ns(const std::string& date, const std::string& subsec,
                                     std::int64_t offset) {
  int y, mo, d, h, mi, s;
  if (std::sscanf(date.c_str(), "%d:%d:%d %d:%d:%d", &y, &mo, &d, &h, &mi, &s) != 6)
    return std::nullopt;
  const std::chrono::year_month_day day{std::chrono::year(y),
                                        std::chrono::month(static_cast<unsigned>(mo)),
                                        std::chrono::day(static_cast<unsigned>(d))};
  if (!day.ok() || y < 1970 || y > 2100 || h < 0 || h > 23 || mi < 0 || mi > 59 || s < 0 || s > 60)
    return std::nullopt;
  std::int64_t seconds =
      std::chrono::sys_days(day).time_since_epoch().count() * 86400LL + h * 3600LL + mi * 60LL + s;
  seconds -= offset;
  std::int64_t fraction_ns = 0, unit = 100'000'000;
  for (char c : subsec) {
    if (!std::isdigit(static_cast<unsigned char>(c)) || unit == 0) break;
    fraction_ns += (c - '0') * unit;
    unit /= 10;
  }
  const std::int64_t ns = seconds * 1'000'000'000LL + fraction_ns;
  return ns > 0 ? std::optional(ns) : std::nullopt;  // 1970 is a clock that nobody has set
}

}  // namespace

ExifInfo read_exif(std::string_view bytes) {
  ExifInfo info;
  // Exiv2's XMP parser keeps global state.
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  try {
    Exiv2::LogMsg::setLevel(Exiv2::LogMsg::mute);
    const auto* data_begin = reinterpret_cast<const Exiv2::byte*>(bytes.data());
    const auto size = static_cast<long>(bytes.size());
    // It also reads videos, for minutes when a size in them is damaged.
    const int type = Exiv2::ImageFactory::getType(data_begin, size);
    if (type != Exiv2::ImageType::jpeg && type != Exiv2::ImageType::png &&
        type != Exiv2::ImageType::tiff) {
      // A BigTIFF, which it doesn't know.
      if (image_format(bytes) == ImageFormat::tiff)
        info.orientation = tiff_orientation(bytes).value_or(1);
      return info;
    }
    const auto image = Exiv2::ImageFactory::open(data_begin, size);
    image->readMetadata();
    const Exiv2::ExifData& data = image->exifData();
    const double orientation = number_of(data, "Exif.Image.Orientation").value_or(1);
    if (orientation >= 1 && orientation <= 8) info.orientation = static_cast<int>(orientation);
    // Exiv2's is the first directory's, which may be that of a preview.
    if (type == Exiv2::ImageType::tiff)
      info.orientation = tiff_orientation(bytes).value_or(info.orientation);
    info.focal_mm = number_of(data, "Exif.Photo.FocalLength");
    info.focal_35mm = number_of(data, "Exif.Photo.FocalLengthIn35mmFilm");
    if (info.focal_mm && *info.focal_mm <= 0) info.focal_mm.reset();
    // A number of no lens (65535: unknown) would be believed as the focal length.
    if (info.focal_35mm && !(*info.focal_35mm >= shortest_35mm && *info.focal_35mm <= longest_35mm))
      info.focal_35mm.reset();
    info.make = text_of(data, "Exif.Image.Make");
    info.model = text_of(data, "Exif.Image.Model");
    info.serial = text_of(data, "Exif.Photo.BodySerialNumber");
    const auto offset = offset_s(text_of(data, "Exif.Photo.OffsetTimeOriginal"));
    info.taken_ns = epoch_ns(text_of(data, "Exif.Photo.DateTimeOriginal"),
                             text_of(data, "Exif.Photo.SubSecTimeOriginal"), offset.value_or(0));
    info.taken_has_offset = offset.has_value();
    info.utc_offset_s = offset.value_or(0);
  } catch (const std::exception&) {
    // No or broken metadata: what was read so far stands.
  }
  return info;
}

}  // namespace orbitfuse
