// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "app/stages/metric_scale.hpp"
#include "core/geometry/transform.hpp"
#include "core/geometry/triangle_mesh.hpp"

namespace orbitfuse::exporting {

/// In which coordinates files are written: the run's world, turned so that `up` is z and scaled to
/// metres where the scale is known.
struct ExportFrame {
  Similarity3d export_from_world;
  std::optional<stages::MetricScale> scale;

  std::string unit() const { return scale ? "metre" : "scene"; }
  /// "metres +- 0.8 % (one distance)", or that no scale is known.
  std::string words() const;
};

/// `up`: a direction of the run's world, zero length for its own z. Errors: usage (not a
/// direction).
Result<ExportFrame> export_frame(const Eigen::Vector3d& up,
                                 const std::optional<stages::MetricScale>& scale);

void transform(const ExportFrame& frame, TriangleMesh& mesh);

/// Axes of a file's coordinates against those of the frame. glTF: y is up.
enum class FileAxes { z_up, y_up };

/// What every sidecar says of its frame: unit, uncertainty, `world_from_export` (4x4), and of the
/// file's own coordinates `up` and `export_from_file` (4x4).
nlohmann::json to_json(const ExportFrame& frame, FileAxes axes = FileAxes::z_up);

/// A sidecar's text for the inside of a GLB: without its matrices, since a program may have turned
/// what it read.
nlohmann::json glb_extras(nlohmann::json sidecar);

}  // namespace orbitfuse::exporting
