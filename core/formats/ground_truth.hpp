// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/modality.hpp"
#include "core/result.hpp"

namespace orbitfuse {

/// A frame whose pose is known exactly; its name is the file as the truth writes it.
struct TrueView : PosedView {
  std::optional<double> azimuth_deg, elevation_deg;
};

/// A view of the truth that shows the scene to both modalities through one camera.
struct TrueTestView {
  std::filesystem::path visible, thermal;  ///< in the truth's folder; empty = not given
  Camera camera;
  Rigid3d cam_from_world;
};

/// Exact poses in metres; docs/formats.md describes the file.
struct GroundTruth {
  std::map<Modality, std::vector<TrueView>> views;
  std::vector<TrueTestView> test;
};

/// Every number is finite and of a size that lengths and pixels have, every pose rigid; anything
/// else is an input error that names the frame.
Result<GroundTruth> read_ground_truth(const std::filesystem::path& file);

/// A single list of frames with one camera: {"K", "frames"} (frames recorded between stations).
Result<std::vector<TrueView>> read_true_views(const std::filesystem::path& file);

}  // namespace orbitfuse
