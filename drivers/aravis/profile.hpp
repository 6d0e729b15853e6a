// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/result.hpp"

namespace orbitfuse::aravis {

/// How samples become kelvin.
enum class SampleScale {
  none,         ///< counts or gray levels; no temperatures (RawCounts)
  linear,       ///< T[K] = kelvin_per_dn * DN
  radiometric,  ///< FLIR: nodes R, B, F, J0, J1 read from the camera
};

using FeatureValue = std::variant<bool, std::int64_t, double, std::string>;

/// What a camera family needs: config/cameras/*.toml. Settings are pushed in order, read back and
/// verified, also after a reconnection.
struct CameraProfile {
  std::string name;
  std::vector<std::string> models;  ///< substrings of the model name that it is for
  std::vector<std::pair<std::string, FeatureValue>> settings;
  SampleScale scale = SampleScale::none;
  double kelvin_per_dn = 0;
  std::string nuc_command;  ///< empty: the camera has none
};

/// A profile file; an unknown key is an error that names it.
Result<CameraProfile> read_profile(const std::filesystem::path& file);

/// The profile called `name`; the usage error for an unknown one lists those in the folder.
Result<CameraProfile> named_profile(const std::filesystem::path& folder, const std::string& name);

/// The first profile in the folder (in name order) with a matching model, else the one called
/// "generic".
Result<CameraProfile> find_profile(const std::filesystem::path& folder, const std::string& model);

}  // namespace orbitfuse::aravis
