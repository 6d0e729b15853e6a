// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/dji_jpeg.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "core/image/image_codec.hpp"
#include "drivers/stills/jpeg_segments.hpp"

namespace orbitfuse {
namespace {

constexpr unsigned char app3 = 0xe3, app4 = 0xe4;
/// Of DJI's thermal sensors; 2 bytes a sample.
constexpr std::array<std::array<int, 2>, 4> sizes{
    {{640, 512}, {1280, 1024}, {320, 256}, {160, 120}}};

/// The segments of one marker before the picture's data, joined.
std::string joined(std::string_view jpeg, unsigned char marker) {
  std::string all;
  for (const JpegSegment& segment : jpeg_segments(jpeg))
    if (segment.marker == marker) all += segment.payload;
  return all;
}

template <class T>
T at(std::string_view bytes, std::size_t place) {
  T value{};
  std::memcpy(&value, bytes.data() + place, sizeof value);  // little-endian, as this machine
  return value;
}

std::optional<DjiParameters> plausible(const DjiParameters& p) {
  const bool good = p.emissivity > 0 && p.emissivity <= 1 && p.distance_m >= 0 &&
                    p.distance_m <= 1000 && p.humidity >= 0 && p.humidity <= 1 &&
                    std::abs(p.reflected_c) <= 1000 && std::abs(p.ambient_c) <= 100;
  return good ? std::optional(p) : std::nullopt;
}

std::optional<DjiParameters> parameters_of(std::string_view b) {
  using namespace std::string_view_literals;
  if (b.size() >= 0x5a && b.substr(0, 4) == "\xaa\x55\x12\x06"sv) {
    const auto number = [&](std::size_t place) { return at<std::uint16_t>(b, place); };
    return plausible({number(0x48) / 100.0, double(number(0x44)), number(0x46) / 100.0,
                      number(0x4a) / 10.0, double(number(0x4c))});
  }
  // The newer ones: five numbers before a mark, with or without a header of 32 bytes.
  for (const std::size_t start : {std::size_t{32}, std::size_t{0}}) {
    if (b.size() < start + 36 || b.substr(start + 32, 4) != "\x2c\x01\x20\0"sv) continue;
    const auto number = [&](std::size_t place) { return double(at<float>(b, start + place)); };
    return plausible({number(8), number(4), number(12), number(16), number(0)});
  }
  return std::nullopt;
}

}  // namespace

bool is_dji_thermal(std::string_view bytes) {
  if (image_format(bytes) != ImageFormat::jpeg) return false;
  // Other makers keep other things there.
  return joined(bytes, app3).size() >= 2 * 160 * 120 && read_exif(bytes).make.starts_with("DJI");
}

Result<DjiImage> read_dji_thermal(std::string_view bytes, const std::string& where) {
  const std::string plane = joined(bytes, app3);
  DjiImage image;
  for (const auto& [width, height] : sizes) {
    if (plane.size() == 2 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
      image.counts.create(height, width, CV_16UC1);
  }
  if (image.counts.empty()) {
    return fail(ErrorKind::input, where,
                fmt::format("a DJI thermal plane of {} bytes, which is no size of its cameras",
                            plane.size()),
                "copy the file from the drone again");
  }
  std::memcpy(image.counts.data, plane.data(), plane.size());
  image.exif = read_exif(bytes);
  image.parameters = parameters_of(joined(bytes, app4));
  return image;
}

}  // namespace orbitfuse
