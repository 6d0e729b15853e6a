// SPDX-License-Identifier: BSD-3-Clause
#include "core/formats/ply.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>
#include <sstream>
#include <string_view>

#include "core/formats/append_bytes.hpp"
#include "core/formats/rigid_matrix.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse {
namespace {

static_assert(std::endian::native == std::endian::little);

enum class PlyFormat { ascii, little_endian, big_endian };

struct PlyType {
  std::size_t size = 0;
  char kind = 'u';  ///< u, i or f
};

struct Property {
  std::string name;
  PlyType type;
  std::optional<PlyType> list_count;
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  PlyFormat format = PlyFormat::ascii;
  std::vector<Element> elements;
  std::size_t body = 0;
};

tl::unexpected<Error> bad(const std::filesystem::path& path, const std::string& found) {
  return fail(ErrorKind::input, path.string(), found, "write the point cloud again as PLY");
}

std::optional<PlyType> type_of(const std::string& name) {
  struct Named {
    const char *of_c, *sized;
    PlyType type;
  };
  static constexpr Named types[] = {
      {"char", "int8", {1, 'i'}},     {"uchar", "uint8", {1, 'u'}},   {"short", "int16", {2, 'i'}},
      {"ushort", "uint16", {2, 'u'}}, {"int", "int32", {4, 'i'}},     {"uint", "uint32", {4, 'u'}},
      {"float", "float32", {4, 'f'}}, {"double", "float64", {8, 'f'}}};
  for (const Named& named : types) {
    if (name == named.of_c || name == named.sized) return named.type;
  }
  return std::nullopt;
}

Result<Header> parse_header(const std::filesystem::path& path, std::string_view bytes) {
  Header header;
  std::size_t at = 0;
  bool first = true, has_format = false;
  while (at < bytes.size()) {
    const std::size_t end = bytes.find('\n', at);
    if (end == std::string_view::npos) break;
    std::string line(bytes.substr(at, end - at));
    at = end + 1;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (first) {
      if (line != "ply") return bad(path, "not a PLY file");
      first = false;
      continue;
    }
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "format") {
      words >> word;
      has_format = true;
      if (word == "ascii")
        header.format = PlyFormat::ascii;
      else if (word == "binary_little_endian")
        header.format = PlyFormat::little_endian;
      else if (word == "binary_big_endian")
        header.format = PlyFormat::big_endian;
      else
        return bad(path, "unknown PLY format \"" + word + "\"");
    } else if (word == "element") {
      Element element;
      // Read into it as it is, -1 would be the largest count.
      if (!(words >> element.name >> word) || word.front() == '-' ||
          !(std::istringstream(word) >> element.count))
        return bad(path, "unreadable line \"" + line + "\"");
      header.elements.push_back(element);
    } else if (word == "property") {
      if (header.elements.empty()) return bad(path, "a property before any element");
      Property property;
      words >> word;
      if (word == "list") {
        words >> word;
        property.list_count = type_of(word);
        if (!property.list_count) return bad(path, "unknown type \"" + word + "\"");
        words >> word;
      }
      const auto type = type_of(word);
      if (!type || !(words >> property.name)) return bad(path, "unreadable line \"" + line + "\"");
      for (const Property& other : header.elements.back().properties) {
        if (other.name == property.name) return bad(path, "two properties " + other.name);
      }
      property.type = *type;
      header.elements.back().properties.push_back(property);
    } else if (word == "end_header") {
      if (!has_format) return bad(path, "no format line");
      header.body = at;
      return header;
    }
  }
  return bad(path, "the header has no end");
}

/// Reads numbers one after the other in either encoding; false when the file ends.
class Reader {
 public:
  Reader(std::string_view bytes, std::size_t at, PlyFormat format)
      : bytes_(bytes), at_(at), format_(format) {}

  bool next(PlyType type, double& value) {
    return format_ == PlyFormat::ascii ? next_ascii(value) : next_binary(type, value);
  }
  bool skip(std::uint64_t bytes) {
    if (bytes > bytes_.size() - at_) return false;
    at_ += bytes;
    return true;
  }
  std::size_t left() const { return bytes_.size() - at_; }

 private:
  bool next_ascii(double& value) {
    while (at_ < bytes_.size() && std::isspace(static_cast<unsigned char>(bytes_[at_]))) ++at_;
    const char* begin = bytes_.data() + at_;
    const char* end = bytes_.data() + bytes_.size();
    if (begin < end && *begin == '+') ++begin;
    const auto [stop, error] = std::from_chars(begin, end, value);
    if (error == std::errc::result_out_of_range)
      value = 0;  // denormals
    else if (error != std::errc())
      return false;
    at_ = static_cast<std::size_t>(stop - bytes_.data());
    return at_ == bytes_.size() || std::isspace(static_cast<unsigned char>(bytes_[at_]));
  }

  bool next_binary(PlyType type, double& value) {
    if (left() < type.size) return false;
    std::array<char, 8> raw{};
    const bool swap = format_ == PlyFormat::big_endian;
    for (std::size_t i = 0; i < type.size && i < raw.size(); ++i) {
      raw[i] = bytes_[at_ + (swap ? type.size - 1 - i : i)];
    }
    at_ += type.size;
    if (type.kind == 'f') {
      value = type.size == 4 ? static_cast<double>(read<float>(raw)) : read<double>(raw);
    } else if (type.kind == 'u') {
      value = type.size == 1   ? read<std::uint8_t>(raw)
              : type.size == 2 ? read<std::uint16_t>(raw)
                               : read<std::uint32_t>(raw);
    } else {
      value = type.size == 1   ? read<std::int8_t>(raw)
              : type.size == 2 ? read<std::int16_t>(raw)
                               : read<std::int32_t>(raw);
    }
    return true;
  }

  template <class T>
  static T read(const std::array<char, 8>& raw) {
    T value;
    std::memcpy(&value, raw.data(), sizeof value);
    return value;
  }

  std::string_view bytes_;
  std::size_t at_;
  PlyFormat format_;
};

/// Fewest bytes one entry of the element can take: the bound for a count.
std::uint64_t least_bytes(const Element& element, PlyFormat format) {
  std::uint64_t n = 0;
  for (const Property& p : element.properties) {
    n += format == PlyFormat::ascii ? 2 : p.list_count ? p.list_count->size : p.type.size;
  }
  return format == PlyFormat::ascii && n > 0 ? n - 1 : n;
}

bool skip_entry(Reader& reader, const Element& element, PlyFormat format) {
  double value = 0;
  for (const Property& p : element.properties) {
    std::uint64_t count = 1;
    if (p.list_count) {
      constexpr double most = 1e15;  // more than any file holds; no overflow of the bytes it takes
      if (!reader.next(*p.list_count, value) || !(value >= 0 && value <= most)) return false;
      count = static_cast<std::uint64_t>(value);
    }
    if (format != PlyFormat::ascii) {
      if (!reader.skip(count * p.type.size)) return false;
      continue;
    }
    for (std::uint64_t i = 0; i < count; ++i) {
      if (!reader.next(p.type, value)) return false;
    }
  }
  return true;
}

constexpr std::array<const char*, 10> known_properties{"x",  "y",   "z",     "nx",   "ny",
                                                       "nz", "red", "green", "blue", "temperature"};

struct Vertex {
  std::array<double, known_properties.size()> values{};
};

class VertexLayout {
 public:
  explicit VertexLayout(const Element& element) {
    for (const Property& p : element.properties) {
      std::optional<std::size_t> slot;
      for (std::size_t k = 0; k < known_properties.size(); ++k) {
        if (!p.list_count && p.name == known_properties[k]) slot = k;
      }
      if (slot) present_[*slot] = true;
      slots_.push_back(slot);
    }
    float_colors_ = false;
    for (const Property& p : element.properties) {
      if (p.name == "red" && p.type.kind == 'f') float_colors_ = true;
    }
  }
  bool has(std::size_t first, std::size_t count) const {
    for (std::size_t k = first; k < first + count; ++k) {
      if (!present_[k]) return false;
    }
    return true;
  }
  /// Where in a Vertex a property goes; nothing for one that is not read.
  std::optional<std::size_t> slot(std::size_t property) const { return slots_[property]; }
  bool float_colors() const { return float_colors_; }

 private:
  std::array<bool, known_properties.size()> present_{};
  std::vector<std::optional<std::size_t>> slots_;
  bool float_colors_;
};

bool read_vertex(Reader& reader, const Element& element, const VertexLayout& layout,
                 PlyFormat format, Vertex& vertex) {
  for (std::size_t i = 0; i < element.properties.size(); ++i) {
    const Property& p = element.properties[i];
    double value = 0;
    if (p.list_count) {
      if (!skip_entry(reader, Element{"", 1, {p}}, format)) return false;
      continue;
    }
    if (!reader.next(p.type, value)) return false;
    if (const auto slot = layout.slot(i)) vertex.values[*slot] = value;
  }
  return true;
}

std::uint8_t color_level(double value, bool is_float) {
  const double level = is_float ? 255.0 * value : value;
  return level >= 0 && level <= 255 ? static_cast<std::uint8_t>(std::lround(level))
                                    : std::uint8_t(level > 255 ? 255 : 0);
}

/// What can't be computed with is no position, as NaN is none.
Eigen::Vector3d usable(const Eigen::Vector3d& position) {
  if (!(position.array().abs() > max_coordinate).any()) return position;
  return Eigen::Vector3d::Constant(std::nan(""));
}

Result<PointCloud> read_vertices(const std::filesystem::path& path, Reader& reader,
                                 const Element& element, PlyFormat format) {
  const VertexLayout layout(element);
  if (!layout.has(0, 3)) return bad(path, "vertices without x, y and z");
  const bool normals = layout.has(3, 3), colors = layout.has(6, 3), temperature = layout.has(9, 1);
  PointCloud cloud;
  cloud.positions.reserve(element.count);
  for (std::uint64_t i = 0; i < element.count; ++i) {
    Vertex vertex;
    if (!read_vertex(reader, element, layout, format, vertex)) {
      return bad(path, fmt::format("vertex {} of {} is cut off or unreadable", i, element.count));
    }
    const auto& v = vertex.values;
    cloud.positions.push_back(usable(Eigen::Vector3d(v[0], v[1], v[2])));
    if (normals) {
      cloud.normals.emplace_back(static_cast<float>(v[3]), static_cast<float>(v[4]),
                                 static_cast<float>(v[5]));
    }
    if (colors) {
      const bool f = layout.float_colors();
      cloud.colors.push_back({color_level(v[6], f), color_level(v[7], f), color_level(v[8], f)});
    }
    if (temperature) cloud.temperatures_k.push_back(static_cast<float>(v[9]));
  }
  return cloud;
}

}  // namespace

Result<PointCloud> read_ply(const std::filesystem::path& path) {
  ORBITFUSE_ASSIGN(const std::string bytes, read_file(path));
  ORBITFUSE_ASSIGN(const Header header, parse_header(path, bytes));
  Reader reader(bytes, header.body, header.format);
  for (const Element& element : header.elements) {
    const std::uint64_t least = std::max<std::uint64_t>(1, least_bytes(element, header.format));
    if (element.count > reader.left() / least + 1) {
      return bad(path, fmt::format("{} {} entries declared, {} bytes left", element.count,
                                   element.name, reader.left()));
    }
    if (element.name == "vertex") return read_vertices(path, reader, element, header.format);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      if (!skip_entry(reader, element, header.format))
        return bad(path, "cut off before the vertices");
    }
  }
  return bad(path, "no vertex element");
}

Status write_ply(const std::filesystem::path& path, const PointCloud& cloud) {
  return write_ply(path, TriangleMesh{cloud, {}}, {});
}

Status write_ply(const std::filesystem::path& path, const TriangleMesh& mesh,
                 const PlyWriteOptions& options) {
  const PointCloud& cloud = mesh.vertices;
  const bool normals = !cloud.normals.empty(), colors = !cloud.colors.empty();
  const bool temperature = !cloud.temperatures_k.empty();
  const auto one_word = [&](const std::string& name) -> Status {
    if (!name.empty() && name.find_first_of(" \t\r\n") == std::string::npos) return {};
    return fail(ErrorKind::input, path.string(), "'" + name + "' as the name of a property",
                "choose one word");
  };
  ORBITFUSE_TRY(one_word(options.temperature_name));
  for (const VertexScalar& scalar : options.scalars) {
    ORBITFUSE_TRY(one_word(scalar.name));
    if (scalar.values.size() != cloud.size())
      return fail(ErrorKind::input, path.string(), scalar.name + " that is not one a vertex",
                  "give each vertex a value, NaN where there is none");
  }
  std::string out =
      "ply\nformat binary_little_endian 1.0\ncomment OrbitFuse; temperature in kelvin\n";
  for (const std::string& comment : options.comments) {
    if (comment.find_first_of("\r\n") != std::string::npos)
      return fail(ErrorKind::input, path.string(), "a comment of several lines",
                  "write one a line");
    out += "comment " + comment + "\n";
  }
  out += fmt::format("element vertex {}\nproperty double x\nproperty double y\nproperty double z\n",
                     cloud.size());
  if (normals) out += "property float nx\nproperty float ny\nproperty float nz\n";
  if (colors) out += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  if (temperature) out += "property float " + options.temperature_name + "\n";
  for (const VertexScalar& scalar : options.scalars) out += "property float " + scalar.name + "\n";
  if (!mesh.empty())
    out += fmt::format("element face {}\nproperty list uchar uint vertex_indices\n",
                       mesh.triangles.size());
  out += "end_header\n";
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    for (int k = 0; k < 3; ++k) append_bytes(out, cloud.positions[i][k]);
    if (normals) {
      for (int k = 0; k < 3; ++k) append_bytes(out, cloud.normals[i][k]);
    }
    if (colors) {
      for (std::uint8_t c : cloud.colors[i]) append_bytes(out, c);
    }
    if (temperature) append_bytes(out, cloud.temperatures_k[i]);
    for (const VertexScalar& scalar : options.scalars) append_bytes(out, scalar.values[i]);
  }
  for (const auto& triangle : mesh.triangles) {
    append_bytes(out, std::uint8_t{3});
    for (const std::uint32_t v : triangle) append_bytes(out, v);
  }
  return write_file_atomic(path, out);
}

}  // namespace orbitfuse
