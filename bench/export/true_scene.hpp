// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "core/formats/ground_truth.hpp"
#include "core/geometry/transform.hpp"
#include "core/geometry/triangle_mesh.hpp"
#include "core/result.hpp"

namespace orbitfuse {

/// Of true_mesh.py or `orbitfuse export`: faces of three follow the vertices at the file's end.
Result<TriangleMesh> read_mesh(const std::filesystem::path& file);

/// The similarity that brings the run's visible cameras nearest to the true ones.
Result<Similarity3d> truth_from_run(const std::filesystem::path& run, const GroundTruth& truth);

}  // namespace orbitfuse
