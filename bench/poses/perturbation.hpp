// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "tests/support/orbit_scenes.hpp"

namespace orbitfuse::scenes {

/// What users' recordings are like, done to a session in memory; changed images go to a folder.
struct Perturbation {
  std::string name = "default";
  double focal_error = 0;        ///< of the thermal prior, relative
  bool focal_unknown = false;    ///< nothing is told of the thermal lens
  double station_error_deg = 0;  ///< added to azimuths with alternating sign
  double start_deg = 0;          ///< added to every azimuth
  bool backwards = false;        ///< the thermal orbit walked and declared the other way
  int missing_stations = 0;      ///< recorded frames that are not there
  int keep_every = 1;            ///< recorded frames; 3: eight of 24
  double noise_k = 0;            ///< standard deviation added
  double roll_deg = 0;           ///< the camera rolled by up to so much, another way each frame
  double blur_px = 0;            ///< at full width
  double radial = 0;             ///< k1 that the lens has and the session doesn't know
  int width_px = 0;              ///< reduced to; 0: as it is
  bool tracking = false;         ///< with the frames recorded between the stations
  bool order_alone = false;      ///< nothing declared of the thermal orbit
  double sector_deg = 360;       ///< of each thermal loop that was walked
  bool one_loop = false;         ///< the first thermal loop alone
  bool spoilt = false;           ///< one thermal image constant, one without a single valid pixel
  bool gray_gain = false;        ///< 8-bit with a gain of its own each image, no temperatures
};

const std::vector<Perturbation>& perturbations();

/// Images that change are written below `folder`, which must exist. Errors: unreadable frames.
Status perturb(Scene& scene, const Perturbation& by, const std::filesystem::path& folder);

}  // namespace orbitfuse::scenes
