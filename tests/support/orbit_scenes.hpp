// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/pose_error.hpp"
#include "core/geometry/reconstruction.hpp"
#include "core/session/session.hpp"

// The shared scenes as sessions in memory, for benchmarks and slow tests: only what a user would
// know (images, capture order, nominal stations, a rough focal), the truth kept apart.
namespace orbitfuse::scenes {

struct Truth {
  std::map<std::string, PosedView> views;  ///< by file
};

struct Scene {
  Session session;
  Truth truth;
  std::vector<PosedView> test;  ///< new views that both modalities would share
};

struct ContainerOptions {
  std::string scene = "container";  ///< under orbits/, or the absolute path of such a folder
  bool tracking = false;
  double visible_focal_error = 0, thermal_focal_error = 0;  ///< of the prior, relative
  bool mirrored_stations = false;                           ///< the operator walked the other way
  double station_error_deg = 0;                             ///< alternating, on top of nature's
};
/// Nominal 30 deg stations in two loops of twelve, azimuth from 0 in each modality.
Scene container_scene(const std::filesystem::path& data, const ContainerOptions& options);
/// A folder of visible images, transforms.json as truth; no stations.
Scene fox_scene(const std::filesystem::path& data);
/// A recorded session with its ground_truth.json beside the manifest.
Scene session_scene(const std::filesystem::path& folder);
/// Folders visible/ and thermal/ of images without anything known; 8-bit or raw thermal.
Scene folder_scene(const std::filesystem::path& folder);

/// An imported or recorded session; truth by the name of each frame's source.
Result<Scene> run_scene(const std::filesystem::path& session, const std::filesystem::path& truth);
/// Thermal frames recorded between the stations, in their order, without stations of their own.
void add_tracking(Scene& scene, const std::filesystem::path& tracking_json);

/// The similarity that brings the model's camera centres onto the true ones.
Result<Similarity3d> truth_from_model(const Reconstruction& model, const Truth& truth);

/// After the similarity that fits `anchor`'s centres to the truth (the visible cameras, when
/// thermal poses are judged in the visible frame). Without such a fit no view is counted.
PoseError pose_error(const Reconstruction& model, const Reconstruction& anchor, const Truth& truth);

}  // namespace orbitfuse::scenes
