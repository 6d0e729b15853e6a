// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "core/geometry/reconstruction.hpp"
#include "core/result.hpp"

namespace orbitfuse {

/// A COLMAP sparse model (cameras, images, points3D; .bin preferred, else .txt). Camera models
/// SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL and OPENCV; another is an input error. Fields
/// that newer versions add (rigs.bin, frames.bin) are ignored. Every count is checked against
/// the file's size before memory is taken. Poses and points in the model's own unit and axes, which
/// are Camera's. Errors: input (no model, damaged, another camera model).
Result<Reconstruction> read_colmap_model(const std::filesystem::path& folder, Modality modality);

enum class ColmapFormat { text, binary };
/// Errors: device.
Status write_colmap_model(const std::filesystem::path& folder, const Reconstruction& model,
                          ColmapFormat format);

}  // namespace orbitfuse
