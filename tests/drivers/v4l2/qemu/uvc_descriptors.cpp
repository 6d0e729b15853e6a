// SPDX-License-Identifier: BSD-3-Clause
#include "tests/drivers/v4l2/qemu/uvc_descriptors.hpp"

#include <cstring>

namespace orbitfuse::v4l2::guest {
namespace {

constexpr std::uint8_t class_interface = 0x24;  // CS_INTERFACE

void append(Bytes& to, const Bytes& from) { to.insert(to.end(), from.begin(), from.end()); }

/// The length in front.
Bytes sized(Bytes body) {
  body.insert(body.begin(), static_cast<std::uint8_t>(body.size() + 1));
  return body;
}

/// wTotalLength at `offset` of the first descriptor, filled in when the rest is known.
Bytes totalled(Bytes all, std::size_t offset) {
  all[offset] = static_cast<std::uint8_t>(all.size());
  all[offset + 1] = static_cast<std::uint8_t>(all.size() >> 8);
  return all;
}

Bytes control_entities() {
  // VC_HEADER: UVC 1.1, 1 MHz clock, one streaming interface.
  Bytes all = sized(
      {class_interface, 0x01, 0x10, 0x01, 0, 0, 0x40, 0x42, 0x0f, 0x00, 1, streaming_interface});
  // Camera terminal: exposure mode (D1) and absolute exposure time (D3); its focus is fixed.
  append(all, sized({class_interface, 0x02, camera_terminal, 0x01, 0x02, 0, 0, 0, 0, 0, 0, 0, 0, 3,
                     0x0a, 0, 0}));
  // Processing unit: white balance temperature (D6) and its automatic (D12).
  append(all, sized({class_interface, 0x05, processing_unit, camera_terminal, 0, 0, 2, 0x40, 0x10,
                     0, 0}));
  append(all, sized({class_interface, 0x03, output_terminal, 0x01, 0x01, 0, processing_unit, 0}));
  return totalled(all, 5);
}

Bytes uncompressed_format(Format format, const char* fourcc) {
  Bytes body{class_interface, 0x04, static_cast<std::uint8_t>(format), 1};
  // The GUID of a FOURCC (UVC 1.1, uncompressed payload, table 2-1).
  for (int i = 0; i < 4; ++i) body.push_back(static_cast<std::uint8_t>(fourcc[i]));
  append(body, {0x00, 0x00, 0x10, 0x00, 0x80, 0x00, 0x00, 0xaa, 0x00, 0x38, 0x9b, 0x71});
  append(body, {16, 1, 0, 0, 0, 0});
  return sized(body);
}

Bytes frame(std::uint8_t subtype, std::uint32_t interval_100ns) {
  Bytes body{class_interface, subtype, 1, 0};
  put(body, width, 2);
  put(body, height, 2);
  const std::uint64_t bit_rate = 8ull * frame_bytes * 10'000'000 / interval_100ns;
  put(body, bit_rate, 4);
  put(body, bit_rate, 4);
  put(body, frame_bytes, 4);
  put(body, interval_100ns, 4);
  body.push_back(1);
  put(body, interval_100ns, 4);
  return sized(body);
}

Bytes stream_formats(std::uint32_t interval_100ns) {
  // VS_INPUT_HEADER: three formats, no still capture, no per-format controls.
  Bytes all = sized({class_interface, 0x01, 3, 0, 0, 0x80 | bulk_endpoint, 0, output_terminal, 0, 0,
                     0, 1, 0, 0, 0});
  append(all, uncompressed_format(Format::yuyv, "YUY2"));
  append(all, frame(0x05, interval_100ns));
  append(all, sized({class_interface, 0x06, static_cast<std::uint8_t>(Format::mjpeg), 1, 1, 1, 0, 0,
                     0, 0}));
  append(all, frame(0x07, interval_100ns));
  append(all, uncompressed_format(Format::y16, "Y16 "));
  append(all, frame(0x05, interval_100ns));
  return totalled(all, 4);
}

}  // namespace

void put(Bytes& bytes, std::uint64_t value, int count) {
  for (int i = 0; i < count; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

std::uint32_t get(const Bytes& bytes, std::size_t offset, int count) {
  std::uint32_t value = 0;
  for (int i = 0; i < count; ++i)
    value |= std::uint32_t{bytes.at(offset + static_cast<std::size_t>(i))} << (8 * i);
  return value;
}

Bytes device_descriptor() {
  Bytes body{0x01, 0x00, 0x02, 0xef, 0x02, 0x01, 64};
  put(body, 0x1209, 2);  // pid.codes: product ids 0001 to 0010 are for tests
  put(body, 0x0001, 2);
  put(body, 0x0100, 2);
  append(body, {1, 2, 3, 1});  // maker, product, serial; one configuration
  return sized(body);
}

Bytes configuration_descriptor(std::uint32_t interval_100ns) {
  Bytes all = sized({0x02, 0, 0, 2, 1, 0, 0x80, 250});
  append(all, sized({0x0b, 0, 2, 0x0e, 0x03, 0, 0}));     // both interfaces are one function
  append(all, sized({0x04, 0, 0, 0, 0x0e, 0x01, 0, 0}));  // video control
  append(all, control_entities());
  append(all, sized({0x04, streaming_interface, 0, 1, 0x0e, 0x02, 0, 0}));
  append(all, stream_formats(interval_100ns));
  append(all, sized({0x05, 0x80 | bulk_endpoint, 0x02, 0x00, 0x02, 0}));  // bulk, 512 bytes
  return totalled(all, 2);
}

Bytes language_descriptor() { return sized({0x03, 0x09, 0x04}); }

Bytes string_descriptor(const std::string& text) {
  Bytes body{0x03};
  for (char c : text) put(body, static_cast<std::uint8_t>(c), 2);
  return sized(body);
}

}  // namespace orbitfuse::v4l2::guest
