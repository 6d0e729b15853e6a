// SPDX-License-Identifier: BSD-3-Clause
#include "core/formats/rigid_matrix.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <nlohmann/json.hpp>

#include "core/geometry/geometry_json.hpp"

namespace orbitfuse {

Result<Rigid3d> rigid_of_opengl_json(const nlohmann::json& rows, const std::string& where) {
  const auto broken = [&](const std::string& found) {
    return fail(ErrorKind::input, where, found, "give the camera-to-world matrix with OpenGL axes");
  };
  constexpr const char* expected = "not a finite 4x4 (or 3x4) rigid matrix";
  nlohmann::json four = rows;
  if (rows.is_array() && rows.size() == 3) four.push_back({0, 0, 0, 1});
  const auto read = matrix_of_json(four);
  if (!read || !read->allFinite()) return broken(expected);
  const Eigen::Matrix4d& m = *read;
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
