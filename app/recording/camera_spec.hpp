// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/modality.hpp"
#include "core/result.hpp"

namespace orbitfuse::recording {

/// How a camera is named on the command line: driver[:camera][,key=value]..., e.g.
/// "aravis:192.168.1.20,profile=flir-radiometric" or "v4l2:/dev/video0,size=1280x720,rate=15".
struct CameraSpec {
  std::string driver, camera;
  std::map<std::string, std::string> settings;

  /// A setting's value, empty when it isn't given.
  std::string value(const std::string& key) const;
};

/// Usage error naming the driver or setting that is unknown and those that exist.
Result<CameraSpec> parse_camera_spec(const std::string& text);

/// Typed settings; usage errors name the setting. Absent settings give the fallback.
Result<double> number(const CameraSpec& spec, const std::string& key, double fallback);
struct ImageSize {
  int width = 0, height = 0;
};
Result<ImageSize> size(const CameraSpec& spec, ImageSize fallback);

Result<bool> yes_or_no(const CameraSpec& spec, const std::string& key);  ///< absent: no

}  // namespace orbitfuse::recording
