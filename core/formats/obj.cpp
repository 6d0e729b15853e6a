// SPDX-License-Identifier: BSD-3-Clause
#include "core/formats/obj.hpp"

#include <fmt/format.h>

#include <iterator>

#include "core/system/file_io.hpp"

namespace orbitfuse {

Status write_obj(const std::filesystem::path& path, const TriangleMesh& mesh,
                 const std::vector<std::string>& comments) {
  const PointCloud& v = mesh.vertices;
  std::string out;
  const auto end = std::back_inserter(out);
  for (const std::string& comment : comments) fmt::format_to(end, "# {}\n", comment);
  for (std::size_t i = 0; i < v.size(); ++i) {
    fmt::format_to(end, "v {:.7g} {:.7g} {:.7g}", v.positions[i].x(), v.positions[i].y(),
                   v.positions[i].z());
    if (!v.colors.empty())
      for (const std::uint8_t level : v.colors[i]) fmt::format_to(end, " {:.4f}", level / 255.0);
    out += '\n';
  }
  for (const Eigen::Vector3f& n : v.normals)
    fmt::format_to(end, "vn {:.4f} {:.4f} {:.4f}\n", n.x(), n.y(), n.z());
  for (const auto& t : mesh.triangles) {
    out += 'f';
    for (const std::uint32_t corner : t)
      v.normals.empty() ? fmt::format_to(end, " {}", corner + 1)
                        : fmt::format_to(end, " {0}//{0}", corner + 1);
    out += '\n';
  }
  return write_file_atomic(path, out);
}

}  // namespace orbitfuse
