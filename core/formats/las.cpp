// SPDX-License-Identifier: BSD-3-Clause
#include "core/formats/las.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>

#include "core/formats/append_bytes.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse {
namespace {

constexpr std::uint16_t header_bytes = 375, record_header_bytes = 54, extra_record_bytes = 192;
constexpr std::uint16_t point_bytes = 36;  // format 7

void append_padded(std::string& out, std::string_view text, std::size_t bytes) {
  out += text.substr(0, bytes);
  out.append(bytes - std::min(bytes, text.size()), '\0');
}

void append_zeros(std::string& out, std::size_t bytes) { out.append(bytes, '\0'); }

/// Finest power of ten, from 1e-6, of which 31 bits reach over the cloud.
double step_of(const Eigen::AlignedBox3d& box) {
  double step = 1e-6;
  while (box.sizes().maxCoeff() / step > 2e9) step *= 10;
  return step;
}

struct LasLayout {
  Eigen::AlignedBox3d box;
  double step = 1e-6;
  std::uint64_t points = 0;
  bool temperatures = false;
  std::uint16_t bytes_a_point() const {
    return static_cast<std::uint16_t>(point_bytes + (temperatures ? 4 : 0));
  }
};

std::string header(const LasLayout& layout) {
  std::string out = "LASF";
  append_bytes(out, std::uint16_t{0});       // file source
  append_bytes(out, std::uint16_t{1 << 4});  // formats 6 and more: a coordinate system is WKT
  append_zeros(out, 16);                     // project
  append_bytes(out, std::uint8_t{1});
  append_bytes(out, std::uint8_t{4});
  append_padded(out, "EXTRACTION", 32);
  append_padded(out, "OrbitFuse", 32);
  append_zeros(out, 4);  // day and year: reproducible files
  append_bytes(out, header_bytes);
  const std::uint32_t records = layout.temperatures ? 1 : 0;
  append_bytes(out, header_bytes + records * (record_header_bytes + extra_record_bytes));
  append_bytes(out, records);
  append_bytes(out, std::uint8_t{7});
  append_bytes(out, layout.bytes_a_point());
  append_zeros(out, 4 + 5 * 4);  // legacy counts: none with this format
  for (int i = 0; i < 3; ++i) append_bytes(out, layout.step);
  for (int d = 0; d < 3; ++d) append_bytes(out, layout.box.min()[d]);
  for (int d = 0; d < 3; ++d) {
    append_bytes(out, layout.box.max()[d]);
    append_bytes(out, layout.box.min()[d]);
  }
  append_zeros(out, 8 + 8 + 4);  // waveforms, extended records
  append_bytes(out, layout.points);
  append_bytes(out, layout.points);  // all are first returns
  append_zeros(out, 14 * 8);
  return out;
}

std::string temperature_record() {
  std::string out;
  append_zeros(out, 2);
  append_padded(out, "LASF_Spec", 16);
  append_bytes(out, std::uint16_t{4});
  append_bytes(out, extra_record_bytes);
  append_padded(out, "Extra bytes", 32);
  append_zeros(out, 2);
  append_bytes(out, std::uint8_t{9});  // float
  append_bytes(out, std::uint8_t{0});  // no minimum, maximum, scale
  append_padded(out, "temperature", 32);
  append_zeros(out, 4 + 5 * 24);
  append_padded(out, "kelvin; NaN: not measured", 32);
  return out;
}

}  // namespace

Status write_las(const std::filesystem::path& path, const PointCloud& cloud) {
  LasLayout layout;
  for (const Eigen::Vector3d& p : cloud.positions) {
    if (!p.allFinite() || (p.array().abs() > 1e12).any())
      return fail(ErrorKind::input, path.string(), "a point that is not finite",
                  "leave such points out");
    layout.box.extend(p);
  }
  if (cloud.empty())
    return fail(ErrorKind::input, path.string(), "no points", "choose a larger box");
  layout.step = step_of(layout.box);
  layout.points = cloud.size();
  layout.temperatures = !cloud.temperatures_k.empty();
  std::string out = header(layout);
  if (layout.temperatures) out += temperature_record();
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    for (int d = 0; d < 3; ++d)
      append_bytes(out, static_cast<std::int32_t>(std::lround(
                            (cloud.positions[i][d] - layout.box.min()[d]) / layout.step)));
    append_bytes(out, std::uint16_t{0});       // intensity
    append_bytes(out, std::uint8_t{0x11});     // return 1 of 1
    append_zeros(out, 1 + 1 + 1 + 2 + 2 + 8);  // flags, class, user, angle, source, time
    for (std::size_t c = 0; c < 3; ++c)        // 16 bits: 255 is 65535
      append_bytes(
          out, static_cast<std::uint16_t>(cloud.colors.empty() ? 32896 : 257 * cloud.colors[i][c]));
    if (layout.temperatures) append_bytes(out, cloud.temperatures_k[i]);
  }
  return write_file_atomic(path, out);
}

}  // namespace orbitfuse
