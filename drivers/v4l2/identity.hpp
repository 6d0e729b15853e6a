// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "core/result.hpp"
#include "drivers/v4l2/video_system.hpp"

namespace orbitfuse::v4l2 {

/// How the user names a camera: "/dev/video0", "serial:ABC", "usb:1-4.2" or "id:046d:0825".
/// A node path names whatever is there now; the others survive unplugging and renumbering.
struct CameraName {
  enum class By { node, serial, usb_path, usb_id };
  By by = By::node;
  std::string value;
};

Result<CameraName> parse_camera_name(const std::string& text);

/// The capture node (VIDEO_CAPTURE and STREAMING; a camera has metadata nodes too) of that camera;
/// device error listing what is connected otherwise.
Result<VideoSystem::Node> find_camera(VideoSystem& system, const CameraName& name);

/// A camera that was opened, to be found again wherever it is plugged in.
struct CameraIdentity {
  VideoSystem::Node node;
  /// Others have its serial too, or it has none: only its port tells it from them.
  bool port_only = false;
};
CameraIdentity identity_of(VideoSystem& system, const VideoSystem::Node& node);
/// The steadiest name of a node: serial where no other has it, else USB port, else the path.
CameraName lasting_name(VideoSystem& system, const VideoSystem::Node& node);
/// The same camera: equal USB id, serial and function, at its own port where others are like it;
/// what is no USB device is known by its path. Device error when it is not there.
Result<VideoSystem::Node> find_again(VideoSystem& system, const CameraIdentity& camera);
/// Another camera that nothing but its port tells from it: equal USB id, serial and function,
/// neither in its own port nor in `except_port`.
std::optional<VideoSystem::Node> look_alike(VideoSystem& system, const CameraIdentity& camera,
                                            const std::string& except_port = {});
std::string text(const CameraName& name);

}  // namespace orbitfuse::v4l2
