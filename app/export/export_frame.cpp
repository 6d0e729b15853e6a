// SPDX-License-Identifier: BSD-3-Clause
#include "app/export/export_frame.hpp"

#include <fmt/format.h>

#include "core/geometry/geometry_json.hpp"

namespace orbitfuse::exporting {
using nlohmann::json;

std::string ExportFrame::words() const {
  if (!scale) return "no scale is known: lengths are in the run's own unit";
  return fmt::format("metres, +- {} ({})", stages::uncertainty_words(*scale), scale->source);
}

Result<ExportFrame> export_frame(const Eigen::Vector3d& up,
                                 const std::optional<stages::MetricScale>& scale) {
  ExportFrame frame;
  frame.scale = scale;
  if (scale) frame.export_from_world.scale = scale->metres_per_unit;
  if (up.isZero(0)) return frame;
  if (!up.allFinite() || !(up.norm() > 1e-9) || !(up.norm() < 1e9))
    return fail(ErrorKind::usage, "--up", "not a direction", "write X,Y,Z, e.g. 0,0,1");
  frame.export_from_world.rotation =
      Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()).normalized();
  return frame;
}

void transform(const ExportFrame& frame, TriangleMesh& mesh) {
  for (Eigen::Vector3d& p : mesh.vertices.positions) p = frame.export_from_world * p;
  const Eigen::Quaternionf rotation = frame.export_from_world.rotation.cast<float>();
  for (Eigen::Vector3f& n : mesh.vertices.normals) n = rotation * n;
}

json to_json(const ExportFrame& frame, FileAxes axes) {
  Eigen::Matrix4d export_from_file = Eigen::Matrix4d::Identity();
  if (axes == FileAxes::y_up) export_from_file.block<2, 2>(1, 1) << 0, -1, 1, 0;
  json j = {{"unit", frame.unit()},
            {"up", axes == FileAxes::y_up ? "y" : "z"},
            {"export_from_file", matrix_json(export_from_file)},
            {"words", frame.words()},
            {"world_from_export", matrix_json(frame.export_from_world.inverse().matrix())}};
  if (frame.scale) j["scale"] = stages::to_json(*frame.scale);
  return j;
}

json glb_extras(json sidecar) {
  for (const char* key : {"world_from_export", "export_from_file"}) sidecar.erase(key);
  return sidecar;
}

}  // namespace orbitfuse::exporting
