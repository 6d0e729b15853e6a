// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/flir_jpeg.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <vector>

#include "core/image/image_codec.hpp"
#include "core/numeric/median.hpp"
#include "drivers/stills/jpeg_ls.hpp"
#include "drivers/stills/jpeg_segments.hpp"

namespace orbitfuse {
namespace {

enum class Order { little, big };

/// Numbers at fixed places of a block; a read outside it gives 0 and clears ok().
class Block {
 public:
  Block(std::string_view bytes, Order order) : bytes_(bytes), order_(order) {}

  std::uint16_t u16(std::size_t at) const { return static_cast<std::uint16_t>(number(at, 2)); }
  std::uint32_t u32(std::size_t at) const { return static_cast<std::uint32_t>(number(at, 4)); }
  double f32(std::size_t at) const {
    const std::uint32_t bits = u32(at);
    float value;
    std::memcpy(&value, &bits, sizeof value);
    return static_cast<double>(value);
  }
  std::string text(std::size_t at, std::size_t length) const {
    if (at >= bytes_.size()) return {};
    const std::string_view field = bytes_.substr(at, length);
    return std::string(field.substr(0, std::min(field.find('\0'), field.size())));
  }
  std::size_t size() const { return bytes_.size(); }
  std::string_view bytes() const { return bytes_; }

 private:
  std::uint64_t number(std::size_t at, std::size_t width) const {
    if (at > bytes_.size() || bytes_.size() - at < width) return 0;
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < width; ++i) {
      const std::size_t k = order_ == Order::big ? i : width - 1 - i;
      value = value << 8 | static_cast<unsigned char>(bytes_[at + k]);
    }
    return value;
  }
  std::string_view bytes_;
  Order order_;
};

tl::unexpected<Error> broken(const std::string& where, const std::string& found) {
  return fail(ErrorKind::input, where, found, "copy the file from the camera again");
}

/// The FLIR file: payloads of the "FLIR\0" APP1 segments, joined by their index.
std::string join_segments(std::string_view jpeg) {
  using namespace std::string_view_literals;
  constexpr unsigned char app1 = 0xe1;
  std::map<int, std::string_view> parts;
  for (const auto& [marker, payload] : jpeg_segments(jpeg)) {
    if (marker == app1 && payload.size() > 8 && payload.substr(0, 5) == "FLIR\0"sv)
      parts.emplace(static_cast<unsigned char>(payload[6]), payload.substr(8));
  }
  std::string joined;
  for (const auto& [index, part] : parts) joined += part;
  return joined;
}

struct Records {
  std::map<int, std::string_view> by_type;
};

constexpr std::string_view fff_magic("FFF\0", 4), aff_magic("AFF\0", 4);
constexpr std::size_t max_recording_frames = 100'000;
/// Cameras write 10 to 30. Each of the headers in a crafted file may announce as many as fit there.
constexpr std::uint64_t max_records = 256;

enum RecordType { raw_data = 0x01, camera_info = 0x20, embedded_image = 0x0e };

Result<Records> read_directory(std::string_view file, const std::string& where) {
  if (!is_flir_recording(file)) {
    return broken(where, "the FLIR data has no FFF header");
  }
  // The version, 100 to 199, tells the byte order.
  const auto plausible = [](std::uint32_t version) { return version >= 100 && version < 200; };
  Order order = Order::big;
  if (!plausible(Block(file, Order::big).u32(0x14))) {
    if (!plausible(Block(file, Order::little).u32(0x14)))
      return broken(where, "unknown FLIR version");
    order = Order::little;
  }
  const Block header(file, order);
  const std::uint64_t offset = header.u32(0x18), count = header.u32(0x1c);
  if (offset > file.size() || count > (file.size() - offset) / 32) {
    return broken(where, fmt::format("{} FLIR records announced in {} bytes", count, file.size()));
  }
  if (count > max_records) {
    return broken(where, fmt::format("{} FLIR records announced, {} at most are one image's", count,
                                     max_records));
  }
  Records records;
  for (std::uint64_t i = 0; i < count; ++i) {
    const Block entry(file.substr(offset + 32 * i, 32), order);
    const std::uint64_t start = entry.u32(0x0c), length = entry.u32(0x10);
    if (entry.u16(0) == 0) continue;
    // A cut file keeps its directory: records beyond the end are as good as absent.
    if (start > file.size() || length > file.size() - start) continue;
    records.by_type.emplace(entry.u16(0), file.substr(start, length));
  }
  return records;
}

/// Where the next file of a recording begins, at `from` or behind it; the end without one. The
/// magic alone may also occur among samples.
std::size_t next_file(std::string_view bytes, std::size_t from) {
  constexpr std::string_view magic_tail("FF\0", 3);  // of either magic
  for (std::size_t at = bytes.find(magic_tail, from + 1); at != bytes.npos;
       at = bytes.find(magic_tail, at + 1))
    if (read_directory(bytes.substr(at - 1), "")) return at - 1;
  return bytes.size();
}

/// Where the records of a file of a recording end; nothing where it has no whole image.
std::optional<std::size_t> end_of_image(std::string_view file) {
  const auto records = read_directory(file, "");
  if (!records || !records->by_type.contains(raw_data) || !records->by_type.contains(camera_info))
    return std::nullopt;
  std::size_t end = 64;
  for (const auto& [type, record] : records->by_type)
    end = std::max(end, static_cast<std::size_t>(record.data() + record.size() - file.data()));
  return end;
}

/// Whether a damaged image lies in the bytes between one of `image_size` and the next, or the end:
/// cameras leave room there, and zeros behind the last.
bool holds_damaged_image(std::string_view gap, std::size_t image_size, bool at_end) {
  if (gap.find(fff_magic) != gap.npos || gap.find(aff_magic) != gap.npos) return true;
  if (at_end && gap.find_first_not_of('\0') == gap.npos) return false;
  return 2 * gap.size() >= image_size;
}

/// In as many parts as images of `image_size` (0: unknown) fit there, each of which is named when
/// it is read.
void add_damaged(std::string_view bytes, std::size_t image_size,
                 std::vector<std::string_view>& frames) {
  const std::size_t fitting = image_size == 0 ? 1 : (bytes.size() + image_size / 2) / image_size;
  const std::size_t parts = std::clamp<std::size_t>(fitting, 1, 1000);
  for (std::size_t i = 0; i < parts; ++i) {
    const std::size_t begin = bytes.size() * i / parts;
    frames.push_back(bytes.substr(begin, bytes.size() * (i + 1) / parts - begin));
  }
}

/// RawData and CameraInfo begin with a 2 in their own byte order.
Order record_order(std::string_view record) {
  return Block(record, Order::little).u16(0) == 2 ? Order::little : Order::big;
}

void read_camera_info(std::string_view record, FlirImage& image) {
  const Block info(record, record_order(record));
  ObjectParameters& o = image.calibration.object;
  o.emissivity = info.f32(0x20);
  o.distance_m = info.f32(0x24);
  o.reflected_k = info.f32(0x28);
  o.atmospheric_k = info.f32(0x2c);
  o.window_k = info.f32(0x30);
  o.window_transmission = info.f32(0x34);
  o.relative_humidity = info.f32(0x3c);
  if (o.relative_humidity > 2) o.relative_humidity /= 100;  // some cameras write percent
  PlanckConstants& p = image.calibration.planck;
  p.r1 = info.f32(0x58);
  p.b = info.f32(0x5c);
  p.f = info.f32(0x60);
  p.r2 = info.f32(0x30c);
  p.o = static_cast<std::int32_t>(info.u32(0x308));
  AtmosphereConstants& a = image.calibration.atmosphere;
  a.alpha1 = info.f32(0x70);
  a.alpha2 = info.f32(0x74);
  a.beta1 = info.f32(0x78);
  a.beta2 = info.f32(0x7c);
  a.x = info.f32(0x80);
  image.lowest_signal = info.u16(0x310);
  image.highest_signal = info.u16(0x312);
  image.camera_model = info.text(0xd4, 32);
  image.camera_serial = info.text(0x104, 16);
  const double fov = info.f32(0x1b4);
  if (fov > 1 && fov < 170) image.horizontal_fov_deg = fov;
  const std::int64_t seconds = info.u32(0x384);
  if (seconds > 0) {
    const std::int64_t milliseconds = info.u32(0x388) & 0xffff;
    image.taken_ns =
        seconds * 1'000'000'000LL + std::min<std::int64_t>(milliseconds, 999) * 1'000'000LL;
    // Minutes from local time to UTC.
    const auto zone = static_cast<std::int16_t>(info.u16(0x38c));
    if (std::abs(zone) <= 14 * 60) image.utc_offset_s = -60 * zone;
  }
}

double median_of(const cv::Mat& image) {
  std::vector<std::uint16_t> samples(image.begin<std::uint16_t>(), image.end<std::uint16_t>());
  return median_in(samples);
}

/// Mean step between neighbours over the spread: noise of a wrong byte order steps everywhere.
double roughness(const cv::Mat& image) {
  cv::Mat values, difference;
  image.convertTo(values, CV_32F);
  cv::absdiff(values.colRange(1, values.cols), values.colRange(0, values.cols - 1), difference);
  cv::Scalar mean, deviation;
  cv::meanStdDev(values, mean, deviation);
  return cv::mean(difference)[0] / std::max(deviation[0], 1e-9);
}

/// PNGs hold samples in either byte order. CameraInfo's raw median decides; without one,
/// smoothness.
cv::Mat in_right_order(const cv::Mat& image, std::string_view camera_record) {
  cv::Mat swapped(image.size(), CV_16UC1);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const std::uint16_t v = image.at<std::uint16_t>(y, x);
      swapped.at<std::uint16_t>(y, x) = static_cast<std::uint16_t>(v << 8 | v >> 8);
    }
  }
  const Block info(camera_record, record_order(camera_record));
  const double median = info.u16(0x338);
  const double low = info.u16(0x310), high = info.u16(0x312);
  if (median > 0 && median >= low && median <= high) {
    return std::abs(median_of(swapped) - median) < std::abs(median_of(image) - median) ? swapped
                                                                                       : image;
  }
  return image.cols > 1 && roughness(swapped) < roughness(image) ? swapped : image;
}

Result<cv::Mat> read_raw_data(std::string_view record, std::string_view camera_record,
                              const std::string& where) {
  const Order order = record_order(record);
  const Block raw(record, order);
  const int width = raw.u16(0x02), height = raw.u16(0x04);
  if (width == 0 || height == 0 || record.size() < 0x20)
    return broken(where, "no size in the raw thermal record");
  const std::string_view pixels = record.substr(0x20);
  if (is_jpeg_ls(pixels)) return decode_jpeg_ls(pixels, where + " (raw thermal JPEG-LS)");
  if (image_format(pixels) == ImageFormat::png) {
    ORBITFUSE_ASSIGN(const cv::Mat image, decode_image(pixels, where + " (raw thermal PNG)"));
    if (image.type() != CV_16UC1) return broken(where, "the raw thermal PNG is not 16-bit grey");
    return in_right_order(image, camera_record);
  }
  const std::size_t needed =
      2ul * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (pixels.size() < needed) {
    return broken(where, fmt::format("raw thermal data of {} bytes, {}x{} needs {}", pixels.size(),
                                     width, height, needed));
  }
  cv::Mat image(height, width, CV_16UC1);
  std::memcpy(image.data, pixels.data(), needed);  // always little-endian
  return image;
}

}  // namespace

bool is_flir_jpeg(std::string_view bytes) {
  return image_format(bytes) == ImageFormat::jpeg && !join_segments(bytes).empty();
}

Result<FlirImage> read_flir_jpeg(std::string_view bytes, const std::string& where) {
  if (image_format(bytes) != ImageFormat::jpeg) return broken(where, "not a JPEG");
  const std::string file = join_segments(bytes);
  if (file.empty()) return broken(where, "no FLIR data in the JPEG");
  return read_flir_file(file, where);
}

bool is_flir_recording(std::string_view bytes) {
  return bytes.size() >= 64 && (bytes.substr(0, 4) == fff_magic || bytes.substr(0, 4) == aff_magic);
}

std::vector<std::string_view> flir_recording_frames(std::string_view bytes) {
  std::vector<std::string_view> frames;
  if (!is_flir_recording(bytes)) return frames;
  std::size_t image_size = 0;  // of the last whole one
  for (std::size_t at = 0; at < bytes.size() && frames.size() < max_recording_frames;) {
    const std::string_view rest = bytes.substr(at);
    std::optional<std::size_t> end = end_of_image(rest);
    // A record that is too long would swallow the images behind its own.
    const bool joins = end && read_directory(rest.substr(*end), "");
    const std::string_view file = rest.substr(0, joins ? *end : next_file(rest, 64));
    at += file.size();
    if (!joins) end = end_of_image(file);
    if (!end) {
      add_damaged(file, image_size, frames);
      continue;
    }
    image_size = *end;
    const std::string_view gap = file.substr(*end);
    const bool damaged = !gap.empty() && holds_damaged_image(gap, image_size, at == bytes.size());
    frames.push_back(damaged ? file.substr(0, *end) : file);
    if (damaged) add_damaged(gap, image_size, frames);
  }
  return frames;
}

Result<FlirImage> read_flir_file(std::string_view file, const std::string& where) {
  ORBITFUSE_ASSIGN(const Records records, read_directory(file, where));
  const auto raw = records.by_type.find(raw_data);
  const auto info = records.by_type.find(camera_info);
  if (raw == records.by_type.end()) return broken(where, "no raw thermal record");
  if (info == records.by_type.end() || info->second.size() < 0x310) {
    return broken(where, "no camera calibration record");
  }
  FlirImage image;
  read_camera_info(info->second, image);
  ORBITFUSE_ASSIGN(image.signal, read_raw_data(raw->second, info->second, where));
  // A range that most of the image lies beyond is none (other firmware may keep something else
  // there).
  const double median = median_of(image.signal);
  if (median < image.lowest_signal || median > image.highest_signal ||
      image.lowest_signal >= image.highest_signal) {
    image.lowest_signal = 0;
    image.highest_signal = 65535;
  }
  if (const auto e = records.by_type.find(embedded_image);
      e != records.by_type.end() && e->second.size() > 0x20) {
    image.embedded_visible = e->second.substr(0x20);
  }
  return image;
}

}  // namespace orbitfuse
