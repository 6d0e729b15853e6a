// SPDX-License-Identifier: BSD-3-Clause
#include "core/formats/rigid_matrix.hpp"

#include <fmt/format.h>

#include <Eigen/LU>

#include <nlohmann/json.hpp>

namespace orbitfuse {

Result<Rigid3d> rigid_of_opengl_json(const nlohmann::json& rows, const std::string& where) {
  const auto broken = [&](const std::string& found) {
    return fail(ErrorKind::input, where, found, "give the camera-to-world matrix with OpenGL axes");
  };
  constexpr const char* expected = "not a finite 4x4 (or 3x4) rigid matrix";
  if (!rows.is_array() || rows.size() < 3 || rows.size() > 4) return broken(expected);
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  for (std::size_t r = 0; r < rows.size(); ++r) {
    if (!rows[r].is_array() || rows[r].size() != 4) return broken(expected);
    for (std::size_t c = 0; c < 4; ++c) {
      if (!rows[r][c].is_number()) return broken(expected);
      m(static_cast<int>(r), static_cast<int>(c)) = rows[r][c].get<double>();
    }
  }
  if (!m.allFinite()) return broken(expected);
  if (m.topRightCorner<3, 1>().cwiseAbs().maxCoeff() > max_coordinate) {
    return broken(
        fmt::format("a position of {:g}", m.topRightCorner<3, 1>().cwiseAbs().maxCoeff()));
  }
  const Eigen::Matrix3d rotation = m.topLeftCorner<3, 3>();
  const double skew = (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm();
  const double bottom = (m.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm();
  if (!(skew < 1e-2))
    return broken(fmt::format("its 3x3 part is no rotation (off by {:.2g})", skew));
  if (!(rotation.determinant() > 0)) return broken("its 3x3 part mirrors");
  if (!(bottom < 1e-6)) return broken("its last row is not 0 0 0 1");
  return cam_from_world_of_opengl(m);
}

}  // namespace orbitfuse
