// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/modality.hpp"
#include "core/geometry/reconstruction.hpp"

namespace orbitfuse::eval {

/// A view of the truth that shows the scene to both modalities through one camera.
struct TestView {
  std::filesystem::path visible, thermal;  ///< absolute; empty = not given
  Camera camera;
  Rigid3d cam_from_world;
};

/// Exact poses in metres; docs/formats.md describes the file.
struct GroundTruth {
  std::map<Modality, std::vector<PosedView>> views;  ///< names as in the file
  std::vector<TestView> test;
};

Result<GroundTruth> read_ground_truth(const std::filesystem::path& file);

}  // namespace orbitfuse::eval
