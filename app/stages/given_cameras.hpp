// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "core/result.hpp"
#include "recon/assembly/new_views.hpp"

namespace orbitfuse::stages {

struct GivenCameras {
  NewViews views;  ///< without lens distortion, named as their files are, else by number
  std::vector<std::string> files;  ///< file_path of each, as it stands there
};

/// The views of a transforms.json, as `--cameras` takes them. Errors: as read_transforms_json();
/// input (a picture too large to be held).
Result<GivenCameras> read_given_cameras(const std::string& file);

}  // namespace orbitfuse::stages
