// SPDX-License-Identifier: BSD-3-Clause
#include "tests/library/flir_jpeg_file.hpp"

#include <cstring>

#include "core/image/image_codec.hpp"

namespace orbitfuse::test {
namespace {

void put(std::string& block, std::size_t at, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i)
    block.at(at + static_cast<std::size_t>(i)) = static_cast<char>(value >> (8 * i));
}

void put_float(std::string& block, std::size_t at, double value) {
  const float narrow = static_cast<float>(value);
  std::uint32_t bits = 0;
  std::memcpy(&bits, &narrow, sizeof bits);
  put(block, at, bits, 4);
}

std::string raw_record(const cv::Mat& counts) {
  std::string record(0x20, '\0');
  put(record, 0, 2, 2);  // little-endian
  put(record, 2, static_cast<std::uint64_t>(counts.cols), 2);
  put(record, 4, static_cast<std::uint64_t>(counts.rows), 2);
  const cv::Mat whole = counts.clone();
  return record.append(whole.ptr<char>(), 2 * whole.total());
}

std::string camera_record(const PlanckConstants& planck) {
  std::string record(0x400, '\0');
  put(record, 0, 2, 2);
  const AtmosphereConstants air;
  const ObjectParameters object;
  put_float(record, 0x20, object.emissivity);
  put_float(record, 0x24, object.distance_m);
  put_float(record, 0x28, object.reflected_k);
  put_float(record, 0x2c, object.atmospheric_k);
  put_float(record, 0x30, object.window_k);
  put_float(record, 0x34, object.window_transmission);
  put_float(record, 0x3c, object.relative_humidity);
  put_float(record, 0x58, planck.r1);
  put_float(record, 0x5c, planck.b);
  put_float(record, 0x60, planck.f);
  put_float(record, 0x70, air.alpha1);
  put_float(record, 0x74, air.alpha2);
  put_float(record, 0x78, air.beta1);
  put_float(record, 0x7c, air.beta2);
  put_float(record, 0x80, air.x);
  put(record, 0x308, static_cast<std::uint32_t>(static_cast<std::int32_t>(planck.o)), 4);
  put_float(record, 0x30c, planck.r2);
  return record;
}

}  // namespace

std::string flir_jpeg_file(const cv::Mat& counts, const PlanckConstants& planck) {
  constexpr std::size_t directory = 64, entry = 32;
  const std::string records[] = {raw_record(counts), camera_record(planck)};
  constexpr int types[] = {0x01, 0x20};
  std::string file(directory + 2 * entry, '\0');
  file.replace(0, 3, "FFF");
  put(file, 0x14, 100, 4);
  put(file, 0x18, directory, 4);
  put(file, 0x1c, 2, 4);
  for (std::size_t i = 0; i < 2; ++i) {
    put(file, directory + i * entry, static_cast<std::uint64_t>(types[i]), 2);
    put(file, directory + i * entry + 0x0c, file.size(), 4);
    put(file, directory + i * entry + 0x10, records[i].size(), 4);
    file += records[i];
  }
  std::string segment("\xff\xe1\0\0FLIR\0\x01\0\0", 12);
  segment += file;
  const std::size_t length = segment.size() - 2;
  segment[2] = static_cast<char>(length >> 8);
  segment[3] = static_cast<char>(length & 0xff);
  const cv::Mat preview(counts.size(), CV_8UC3, cv::Scalar::all(128));
  return encode_jpeg(preview, 90)->insert(2, segment);
}

}  // namespace orbitfuse::test
