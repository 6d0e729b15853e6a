// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/geometry/triangle_mesh.hpp"

// A yard with boxes of different sizes on flat ground, as a mesh with normals, and cameras round
// it.
namespace orbitfuse::test {

inline void add_face(TriangleMesh& mesh, const Eigen::Vector3d& corner, const Eigen::Vector3d& u,
                     const Eigen::Vector3d& v, double step) {
  const Eigen::Vector3f normal = u.cross(v).normalized().cast<float>();
  const int columns = std::max(1, static_cast<int>(std::lround(u.norm() / step))),
            rows = std::max(1, static_cast<int>(std::lround(v.norm() / step)));
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  const auto at = [&](int column, int row) {
    return first + static_cast<std::uint32_t>(row * (columns + 1) + column);
  };
  for (int row = 0; row <= rows; ++row)
    for (int column = 0; column <= columns; ++column) {
      mesh.vertices.positions.push_back(corner + u * (1.0 * column / columns) +
                                        v * (1.0 * row / rows));
      mesh.vertices.normals.push_back(normal);
    }
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      mesh.triangles.push_back({at(column, row), at(column + 1, row), at(column + 1, row + 1)});
      mesh.triangles.push_back({at(column, row), at(column + 1, row + 1), at(column, row + 1)});
    }
}

/// On the ground, its lowest corner at x, y.
struct Box {
  double x, y, width, depth, height;
};

/// Takes away the ground below boxes, which no camera sees.
inline void open_below(const std::vector<Box>& boxes, TriangleMesh& ground) {
  const auto below = [&](std::uint32_t v) {
    const Eigen::Vector3d& p = ground.vertices.positions[v];
    return std::any_of(boxes.begin(), boxes.end(), [&](const Box& b) {
      return p.x() > b.x && p.x() < b.x + b.width && p.y() > b.y && p.y() < b.y + b.depth;
    });
  };
  std::erase_if(ground.triangles,
                [&](const auto& t) { return below(t[0]) || below(t[1]) || below(t[2]); });
  for (std::uint32_t v = 0; v < ground.vertices.size(); ++v)
    if (below(v)) ground.vertices.normals[v].setZero();
}

inline TriangleMesh yard(const std::vector<Box>& boxes, double step = 0.08) {
  TriangleMesh mesh;
  add_face(mesh, {-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, step);
  open_below(boxes, mesh);
  for (const Box& b : boxes) {
    const Eigen::Vector3d low(b.x, b.y, 0), x(b.width, 0, 0), y(0, b.depth, 0), z(0, 0, b.height);
    add_face(mesh, low + z, x, y, step);
    add_face(mesh, low, x, z, step);
    add_face(mesh, low + x, y, z, step);
    add_face(mesh, low + x + y, -x, z, step);
    add_face(mesh, low + y, -y, z, step);
  }
  return mesh;
}

inline const Box house{-1.2, -0.6, 1.7, 0.9, 1.1}, shed{0.9, 0.7, 0.5, 0.7, 0.5},
    crate{-1, 1.2, 0.4, 0.4, 0.4};

/// Twelve cameras in a circle that look at the middle from above.
inline std::vector<PosedView> cameras_round() {
  std::vector<PosedView> views;
  for (int i = 0; i < 12; ++i) {
    const double azimuth = 2 * std::numbers::pi * i / 12;
    const Eigen::Vector3d eye(5 * std::cos(azimuth), 5 * std::sin(azimuth), 3.5),
        forward = (Eigen::Vector3d(0, 0, 0.3) - eye).normalized(),
        right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
    Eigen::Matrix3d cam_from_world;
    cam_from_world << right.transpose(), forward.cross(right).transpose(), forward.transpose();
    PosedView view;
    view.name = "visible/" + std::to_string(i);
    view.camera.width = 320;
    view.camera.height = 240;
    view.camera.fx = view.camera.fy = 260;
    view.camera.cx = 160;
    view.camera.cy = 120;
    view.cam_from_world.rotation = Eigen::Quaterniond(cam_from_world);
    view.cam_from_world.translation = -(cam_from_world * eye);
    views.push_back(view);
  }
  return views;
}

inline TriangleMesh moved(TriangleMesh mesh, const Similarity3d& a_from_b) {
  for (Eigen::Vector3d& p : mesh.vertices.positions) p = a_from_b * p;
  for (Eigen::Vector3f& n : mesh.vertices.normals) n = a_from_b.rotation.cast<float>() * n;
  return mesh;
}

}  // namespace orbitfuse::test
