// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/made_files.hpp"

#include <charls/charls.h>
#include <libheif/heif.h>

#include <cmath>
#include <cstring>
#include <utility>

#include "core/image/image_codec.hpp"

// Debian's x265, which the HEIC photos are made with, leaks when an encoder is closed. Unused
// without a sanitizer.
extern "C" const char* __lsan_default_suppressions() { return "leak:libx265\n"; }

namespace orbitfuse::made {
namespace {

void put_number(std::string& to, std::size_t at, std::uint64_t value, int bytes) {
  if (to.size() < at + static_cast<std::size_t>(bytes))
    to.resize(at + static_cast<std::size_t>(bytes));
  for (int i = 0; i < bytes; ++i)
    to[at + static_cast<std::size_t>(i)] = static_cast<char>(value >> (8 * i));
}

void put_float(std::string& to, std::size_t at, double value) {
  const auto narrow = static_cast<float>(value);
  std::uint32_t bits;
  std::memcpy(&bits, &narrow, sizeof bits);
  put_number(to, at, bits, 4);
}

/// The directory is big-endian, records little-endian, as cameras write them.
void put_big(std::string& to, std::size_t at, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i)
    to[at + static_cast<std::size_t>(i)] = static_cast<char>(value >> (8 * (bytes - 1 - i)));
}

std::string samples_of(const cv::Mat& image) {
  std::string bytes;
  for (int y = 0; y < image.rows; ++y)
    bytes.append(reinterpret_cast<const char*>(image.ptr(y)),
                 static_cast<std::size_t>(image.cols) * image.elemSize());
  return bytes;
}

std::string jpeg_ls(const cv::Mat& signal) {
  charls::jpegls_encoder encoder;
  encoder.frame_info(
      {static_cast<std::uint32_t>(signal.cols), static_cast<std::uint32_t>(signal.rows), 16, 1});
  std::string bytes(encoder.estimated_destination_size(), '\0');
  encoder.destination(bytes.data(), bytes.size());
  const cv::Mat whole = signal.clone();
  bytes.resize(encoder.encode(whole.data, whole.total() * whole.elemSize()));
  return bytes;
}

std::string raw_record(const cv::Mat& signal, FlirPixels pixels) {
  std::string record(0x20, '\0');
  put_number(record, 0, 2, 2);
  put_number(record, 2, static_cast<std::uint64_t>(signal.cols), 2);
  put_number(record, 4, static_cast<std::uint64_t>(signal.rows), 2);
  if (pixels == FlirPixels::raw) return record + samples_of(signal);
  if (pixels == FlirPixels::jpeg_ls) return record + jpeg_ls(signal);
  cv::Mat swapped = signal.clone();
  for (auto it = swapped.begin<std::uint16_t>(); it != swapped.end<std::uint16_t>(); ++it)
    *it = static_cast<std::uint16_t>(*it << 8 | *it >> 8);
  return record + *encode_png(swapped);
}

std::string camera_record(const cv::Mat& signal, const FlirCalibration& c, SignalRange range) {
  std::string record(0x400, '\0');
  put_number(record, 0, 2, 2);
  const std::pair<std::size_t, double> numbers[] = {{0x20, c.object.emissivity},
                                                    {0x24, c.object.distance_m},
                                                    {0x28, c.object.reflected_k},
                                                    {0x2c, c.object.atmospheric_k},
                                                    {0x30, c.object.window_k},
                                                    {0x34, c.object.window_transmission},
                                                    {0x3c, c.object.relative_humidity},
                                                    {0x58, c.planck.r1},
                                                    {0x5c, c.planck.b},
                                                    {0x60, c.planck.f},
                                                    {0x70, c.atmosphere.alpha1},
                                                    {0x74, c.atmosphere.alpha2},
                                                    {0x78, c.atmosphere.beta1},
                                                    {0x7c, c.atmosphere.beta2},
                                                    {0x80, c.atmosphere.x},
                                                    {0x30c, c.planck.r2},
                                                    {0x1b4, 25.0}};
  for (const auto& [at, value] : numbers) put_float(record, at, value);
  put_number(record, 0x308, static_cast<std::uint32_t>(static_cast<std::int32_t>(c.planck.o)), 4);
  record.replace(0xd4, 12, "Made T640 IR");
  record.replace(0x104, 6, "000042");
  put_number(record, 0x310, static_cast<std::uint64_t>(range.lowest), 2);
  put_number(record, 0x312, static_cast<std::uint64_t>(range.highest), 2);
  put_number(record, 0x338, signal.at<std::uint16_t>(signal.rows / 2, signal.cols / 2), 2);
  put_number(record, 0x384, 1'700'000'000, 4);
  return record;
}

void put_segment(std::string& to, unsigned char marker, const std::string& payload) {
  to += '\xff';
  to += static_cast<char>(marker);
  to += static_cast<char>((payload.size() + 2) >> 8);
  to += static_cast<char>((payload.size() + 2) & 0xff);
  to += payload;
}

}  // namespace

FlirCalibration flir_calibration() {
  FlirCalibration c;
  c.planck = {16556.0, 0.046952, 1428.0, 1.0, -207.0};
  c.object = {1.0, 1.0, 293.15, 293.15, 293.15, 1.0, 0.5};
  return c;
}

std::uint16_t flir_signal(double kelvin, const FlirCalibration& c) {
  const FlirThermometer thermometer(c);
  std::uint16_t best = 0;
  double error = 1e9;
  for (int s = 0; s < 65536; ++s) {
    const double t = thermometer.kelvin(static_cast<std::uint16_t>(s));
    if (std::isfinite(t) && std::abs(t - kelvin) < error) {
      error = std::abs(t - kelvin);
      best = static_cast<std::uint16_t>(s);
    }
  }
  return best;
}

std::string flir_file(const cv::Mat& signal, const FlirCalibration& calibration, FlirPixels pixels,
                      const std::string& embedded_photo, SignalRange range) {
  std::vector<std::pair<int, std::string>> records{
      {0x01, raw_record(signal, pixels)}, {0x20, camera_record(signal, calibration, range)}};
  if (!embedded_photo.empty()) records.emplace_back(0x0e, std::string(0x20, '\0') + embedded_photo);
  std::string file(64 + 32 * records.size(), '\0');
  file.replace(0, 4, "FFF\0", 4);
  put_big(file, 0x14, 101, 4);
  put_big(file, 0x18, 64, 4);
  put_big(file, 0x1c, records.size(), 4);
  for (std::size_t i = 0; i < records.size(); ++i) {
    put_big(file, 64 + 32 * i, static_cast<std::uint64_t>(records[i].first), 2);
    put_big(file, 64 + 32 * i + 0x0c, file.size(), 4);
    put_big(file, 64 + 32 * i + 0x10, records[i].second.size(), 4);
    file += records[i].second;
  }
  return file;
}

std::string flir_jpeg(const cv::Mat& signal, const FlirCalibration& calibration, FlirPixels pixels,
                      const std::string& embedded_photo, std::size_t segment_bytes,
                      SignalRange range) {
  const std::string file = flir_file(signal, calibration, pixels, embedded_photo, range);
  cv::Mat picture;
  signal.convertTo(picture, CV_8U, 1.0 / 256);
  const std::string jpeg = *encode_jpeg(picture, 80);
  std::string out = jpeg.substr(0, 2);
  const std::size_t parts = (file.size() + segment_bytes - 1) / segment_bytes;
  for (std::size_t i = 0; i < parts; ++i) {
    std::string payload("FLIR\0\1", 6);
    payload += static_cast<char>(i);
    payload += static_cast<char>(parts - 1);
    put_segment(out, 0xe1, payload + file.substr(i * segment_bytes, segment_bytes));
  }
  return out + jpeg.substr(2);
}

std::string tiff_of_pages(const std::vector<cv::Mat>& pages, const std::string& description) {
  return tiff_of_pages(pages, TiffWords{description, {}});
}

std::string tiff_of_pages(const std::vector<cv::Mat>& pages, const TiffWords& words) {
  const std::string& description = words.description;
  const auto channels = static_cast<std::uint64_t>(words.channels);
  std::string out("II*\0\0\0\0\0", 8);
  std::size_t link = 4;  // where the offset of the next directory goes
  for (const cv::Mat& page : pages) {
    const std::size_t pixels_at = out.size();
    out += samples_of(page);
    const std::size_t text_at = out.size();
    out += description + '\0';
    const std::size_t metadata_at = out.size();
    out += words.gdal_metadata + '\0';
    const std::size_t bits_at = out.size() + out.size() % 2;
    const auto bits = static_cast<std::uint64_t>(8 * page.elemSize1());
    for (std::uint64_t i = 0; i < channels; ++i) put_number(out, bits_at + 2 * i, bits, 2);
    // In planes each colour has a strip of its own.
    const std::uint64_t planes = words.planar == 1 ? 1 : channels;
    const std::uint64_t plane_bytes = page.total() * page.elemSize() / planes;
    const std::size_t planes_at = out.size();
    for (std::uint64_t i = 0; i < planes; ++i) {
      put_number(out, planes_at + 4 * i, pixels_at + i * plane_bytes, 4);
      put_number(out, planes_at + 4 * (planes + i), plane_bytes, 4);
    }
    const std::size_t directory = out.size();
    put_number(out, link, directory, 4);
    struct Entry {
      std::uint64_t tag, type, count, value;
    };
    std::vector<Entry> entries;
    if (words.subfile_of_first != 0 && link == 4)
      entries.push_back({254, 4, 1, static_cast<std::uint64_t>(words.subfile_of_first)});
    entries.insert(entries.end(), {{256, 4, 1, static_cast<std::uint64_t>(page.cols) / channels},
                                   {257, 4, 1, static_cast<std::uint64_t>(page.rows)},
                                   {258, 3, channels, channels > 2 ? bits_at : bits},
                                   {259, 3, 1, 1},
                                   {262, 3, 1, static_cast<std::uint64_t>(words.photometric)}});
    if (description.size() > 3) entries.push_back({270, 2, description.size() + 1, text_at});
    entries.push_back({273, 4, planes, planes > 1 ? planes_at : pixels_at});
    const bool is_other = link == 4 && words.orientation_of_first != 0;
    if (const int way = is_other ? words.orientation_of_first : words.orientation; way != 0)
      entries.push_back({274, 3, 1, static_cast<std::uint64_t>(way)});
    entries.push_back({277, 3, 1, channels});
    entries.push_back({278, 4, 1, static_cast<std::uint64_t>(page.rows)});
    entries.push_back({279, 4, planes, planes > 1 ? planes_at + 4 * planes : plane_bytes});
    if (words.planar != 1) entries.push_back({284, 3, 1, static_cast<std::uint64_t>(words.planar)});
    if (words.gdal_metadata.size() > 3)
      entries.push_back({42112, 2, words.gdal_metadata.size() + 1, metadata_at});
    put_number(out, directory, entries.size(), 2);
    for (std::size_t i = 0; i < entries.size(); ++i) {
      const std::size_t at = directory + 2 + 12 * i;
      put_number(out, at, entries[i].tag, 2);
      put_number(out, at + 2, entries[i].type, 2);
      put_number(out, at + 4, entries[i].count, 4);
      put_number(out, at + 8, entries[i].value, 4);
    }
    link = directory + 2 + 12 * entries.size();
    put_number(out, link, 0, 4);
  }
  return out;
}

std::string dji_jpeg(const cv::Mat& counts, bool with_parameters) {
  const auto segment = [](unsigned char marker, const std::string& payload) {
    std::string bytes{'\xff', static_cast<char>(marker), 0, 0};
    put_big(bytes, 2, payload.size() + 2, 2);
    return bytes + payload;
  };
  std::string exif("II*\0\10\0\0\0", 8);
  put_number(exif, 8, 1, 2);  // one entry: the maker
  put_number(exif, 10, 0x10f, 2);
  put_number(exif, 12, 2, 2);
  put_number(exif, 14, 4, 4);
  exif += std::string("DJI\0\0\0\0\0", 8);
  std::string parameters(128, '\0');
  int place = 32;
  for (const double value : {21.0, 5.0, 0.95, 0.7, 23.0})
    put_float(parameters, static_cast<std::size_t>(std::exchange(place, place + 4)), value);
  put_number(parameters, 64, 0x0020012c, 4);
  const std::string jpeg = *encode_jpeg(cv::Mat(12, 16, CV_8UC3, cv::Scalar(10, 80, 200)), 80);
  const std::string samples = samples_of(counts);
  std::string bytes = jpeg.substr(0, 2) + segment(0xe1, std::string("Exif\0\0", 6) + exif);
  for (std::size_t at = 0; at < samples.size(); at += 65532)
    bytes += segment(0xe3, samples.substr(at, 65532));
  if (with_parameters) bytes += segment(0xe4, parameters);
  return bytes + jpeg.substr(2);
}

std::string exif_block(int orientation) {
  std::string tiff("II*\0\10\0\0\0", 8);
  const auto number = [&tiff](std::uint64_t value, int bytes) {
    put_number(tiff, tiff.size(), value, bytes);
  };
  const auto entry = [&](std::uint64_t tag, std::uint64_t type, std::uint64_t count,
                         std::uint64_t value) {
    number(tag, 2), number(type, 2), number(count, 4), number(value, 4);
  };
  number(2, 2);
  entry(0x112, 3, 1, static_cast<std::uint64_t>(orientation));
  entry(0x8769, 4, 1, 38);
  number(0, 4);
  number(3, 2);
  entry(0x9003, 2, 20, 80);
  entry(0x920a, 5, 1, 100);
  entry(0xa405, 3, 1, 26);
  number(0, 4);
  tiff += std::string("2024:05:06 07:08:09\0", 20);
  number(43, 4), number(10, 4);
  return tiff;
}

std::string heic(const cv::Mat& image, int orientation, const std::string& exif) {
  std::string bytes;
  heif_context* context = heif_context_alloc();
  heif_encoder* encoder = nullptr;
  if (heif_context_get_encoder_for_format(context, heif_compression_HEVC, &encoder).code ==
      heif_error_Ok) {
    heif_encoder_set_lossy_quality(encoder, 95);
    heif_image* picture = nullptr;
    const int channels = image.channels();
    heif_image_create(image.cols, image.rows, heif_colorspace_RGB,
                      channels == 4 ? heif_chroma_interleaved_RGBA : heif_chroma_interleaved_RGB,
                      &picture);
    heif_image_add_plane(picture, heif_channel_interleaved, image.cols, image.rows, 8 * channels);
    int stride = 0;
    std::uint8_t* plane = heif_image_get_plane(picture, heif_channel_interleaved, &stride);
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        const std::uint8_t* pixel = image.ptr(y) + channels * x;
        for (int c = 0; c < channels; ++c)
          plane[y * stride + channels * x + c] = pixel[c < 3 ? 2 - c : c];
      }
    }
    heif_encoding_options* options = heif_encoding_options_alloc();
    options->image_orientation = static_cast<heif_orientation>(orientation);
    heif_image_handle* handle = nullptr;
    heif_context_encode_image(context, picture, encoder, options, &handle);
    if (handle && !exif.empty())
      heif_context_add_exif_metadata(context, handle, exif.data(), static_cast<int>(exif.size()));
    heif_writer writer{1, [](heif_context*, const void* data, std::size_t size, void* to) {
                         static_cast<std::string*>(to)->assign(static_cast<const char*>(data),
                                                               size);
                         return heif_error{heif_error_Ok, heif_suberror_Unspecified, ""};
                       }};
    if (handle) heif_context_write(context, &writer, &bytes);
    heif_image_handle_release(handle);
    heif_encoding_options_free(options);
    heif_image_release(picture);
    heif_encoder_release(encoder);
  }
  heif_context_free(context);
  return bytes;
}

}  // namespace orbitfuse::made
