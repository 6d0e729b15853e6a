// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "core/result.hpp"
#include "drivers/usb/usb_bus.hpp"
#include "drivers/v4l2/video_system.hpp"

namespace orbitfuse::recording {

/// A camera as `orbitfuse devices` shows it.
struct Connected {
  std::string driver;  ///< "aravis", "v4l2" or "usb" (a camera that no driver here streams)
  std::string name;    ///< what --visible or --thermal takes, e.g. "v4l2:serial:SN42"
  std::string model, serial, where;
  std::string remark;  ///< e.g. "USB 2 speed: ..."

  bool operator==(const Connected&) const = default;
};

/// One entry per V4L2 camera (metadata nodes of the same camera are left out), then USB cameras
/// without a video node. Speeds come from the bus listing.
std::vector<Connected> usb_cameras(v4l2::VideoSystem& video,
                                   const std::vector<usb::UsbDevice>& bus);
/// Cameras that answer on the network.
std::vector<Connected> network_cameras();

/// Entries of `after` that are not in `before`.
std::vector<Connected> added(const std::vector<Connected>& before,
                             const std::vector<Connected>& after);

}  // namespace orbitfuse::recording
