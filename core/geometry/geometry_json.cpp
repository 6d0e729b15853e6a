// SPDX-License-Identifier: BSD-3-Clause
#include "core/geometry/geometry_json.hpp"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

namespace orbitfuse {
namespace {

using Json = nlohmann::json;

constexpr double largest_side_px = 1e6;

Json rotation_json(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }
Json translation_json(const Eigen::Vector3d& t) { return {t.x(), t.y(), t.z()}; }

}  // namespace

Json pinhole_json(const Camera& c) {
  return {{"width", c.width}, {"height", c.height}, {"fx", c.fx},
          {"fy", c.fy},       {"cx", c.cx},         {"cy", c.cy}};
}

Json camera_json(const Camera& c) {
  Json json = pinhole_json(c);
  json.update({{"k1", c.k1}, {"k2", c.k2}, {"p1", c.p1}, {"p2", c.p2}});
  return json;
}

Result<Camera> camera_of_json(const JsonFields& fields) {
  Camera c;
  ORBITFUSE_TRY(fields.get("width", c.width, from_to(0, largest_side_px)));
  ORBITFUSE_TRY(fields.get("height", c.height, from_to(0, largest_side_px)));
  ORBITFUSE_TRY(fields.get_all("fx", c.fx, "fy", c.fy, "cx", c.cx, "cy", c.cy));
  bool bent = false;
  for (const char* key : {"k1", "k2", "p1", "p2"}) bent = bent || fields.has(key);
  if (bent) ORBITFUSE_TRY(fields.get_all("k1", c.k1, "k2", c.k2, "p1", c.p1, "p2", c.p2));
  ORBITFUSE_TRY(c.validate(fields.place()));
  return c;
}

Json rigid_json(const Rigid3d& a_from_b) {
  return {{"rotation_wxyz", rotation_json(a_from_b.rotation)},
          {"translation", translation_json(a_from_b.translation)}};
}

Json similarity_json(const Similarity3d& a_from_b) {
  return {{"scale", a_from_b.scale},
          {"rotation_wxyz", rotation_json(a_from_b.rotation)},
          {"translation", translation_json(a_from_b.translation)}};
}

Result<Rigid3d> rigid_of_json(const JsonFields& fields) {
  std::array<double, 4> q{};
  Rigid3d pose;
  ORBITFUSE_TRY(fields.get_all("rotation_wxyz", q, "translation", pose.translation));
  pose.rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
  if (std::abs(pose.rotation.norm() - 1.0) > 1e-3)
    return fields.wrong("rotation_wxyz", "a unit quaternion");
  pose.rotation.normalize();
  return pose;
}

Result<Similarity3d> similarity_of_json(const JsonFields& fields) {
  ORBITFUSE_ASSIGN(const Rigid3d turn, rigid_of_json(fields));
  Similarity3d similarity{1, turn.rotation, turn.translation};
  ORBITFUSE_TRY(fields.get("scale", similarity.scale, above(0)));
  return similarity;
}

Json matrix_json(const Eigen::Matrix4d& m) {
  Json rows = Json::array();
  for (int r = 0; r < 4; ++r) rows.push_back({m(r, 0), m(r, 1), m(r, 2), m(r, 3)});
  return rows;
}

std::optional<Eigen::Matrix4d> matrix_of_json(const Json& rows) {
  Eigen::Matrix4d m;
  if (!rows.is_array() || rows.size() != 4) return std::nullopt;
  for (std::size_t r = 0; r < 4; ++r) {
    if (!rows[r].is_array() || rows[r].size() != 4) return std::nullopt;
    for (std::size_t c = 0; c < 4; ++c) {
      if (!rows[r][c].is_number()) return std::nullopt;
      m(static_cast<int>(r), static_cast<int>(c)) = rows[r][c].get<double>();
    }
  }
  return m;
}

}  // namespace orbitfuse
