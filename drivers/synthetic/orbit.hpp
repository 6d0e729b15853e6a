// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "capture/frame_source.hpp"
#include "core/progress.hpp"
#include "core/result.hpp"

// A deterministic rendered world seen by two unsynchronised cameras, with exact ground truth.
namespace orbitfuse {

/// What spoils a thermal image (all zero = ideal).
struct ThermalDefects {
  double noise_k = 0.040;         ///< NETD of a good uncooled camera
  double fixed_pattern_k = 0.05;  ///< per-pixel offset that stays for the session
  double vignetting_k = 0.25;     ///< loss in the corners
  double drift_k = 0.15;          ///< per-frame offset, sigma
};

/// One camera's walk round the object.
struct OrbitOptions {
  int width = 640, height = 480;
  double horizontal_fov_deg = 58;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0;  ///< Camera's distortion
  double station_spacing_deg = 30;
  std::vector<double> elevations_deg{14, 34};  ///< one per loop
  double first_azimuth_deg = 0;
  double distance_m = 5;
  double azimuth_jitter_deg = 3;  ///< sigma of the operator's error
  double elevation_jitter_deg = 1.5;
  double distance_jitter = 0.04;  ///< relative
  double aim_jitter_deg = 1.2;    ///< of the optical axis about the object
  double roll_jitter_deg = 1.0;
  int tracking_per_station = 0;  ///< extra frames between stations

  Status validate() const;
};

struct SyntheticOptions {
  OrbitOptions visible, thermal;
  ThermalDefects defects;
  double visible_noise = 1.2;  ///< sigma, 8-bit levels
  int samples_per_axis = 3;    ///< antialiasing: n x n rays a pixel
  int jpeg_quality = 92;
  int test_views = 8;
  std::uint64_t seed = 1;

  Status validate() const;
};

/// The defaults of replay_data/: two loops of twelve stations per modality, other lenses.
SyntheticOptions replay_orbit_options();

/// A camera in the rendered world as a FrameSource; frames carry stations, never poses.
std::unique_ptr<FrameSource> make_synthetic_source(const SyntheticOptions& options,
                                                   Modality modality);

/// Poses, intrinsics and station of every frame, and the test views, in the format of
/// docs/formats.md; test images go to `folder`/test.
Status write_synthetic_truth(const SyntheticOptions& options, const std::filesystem::path& folder);

/// Records both cameras with the real recorder into `folder` (new) and writes the truth beside it:
/// folder/{manifest.jsonl,visible,thermal}, folder/ground_truth.json, folder/test/.
Status record_synthetic_session(const SyntheticOptions& options,
                                const std::filesystem::path& folder, const Progress& progress = {});

}  // namespace orbitfuse
