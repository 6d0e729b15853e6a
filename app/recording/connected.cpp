// SPDX-License-Identifier: BSD-3-Clause
#include "app/recording/connected.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "drivers/aravis/aravis_source.hpp"
#include "drivers/v4l2/identity.hpp"

namespace orbitfuse::recording {
namespace {

constexpr int usb2_megabit_s = 480;

std::string remark_on(const usb::UsbDevice& device) {
  if (device.megabit_s == 0 || device.megabit_s > usb2_megabit_s) return {};
  return fmt::format("runs at {} Mbit/s; a USB 3 camera needs a USB 3 port and cable",
                     device.megabit_s);
}

}  // namespace

std::vector<Connected> usb_cameras(v4l2::VideoSystem& video,
                                   const std::vector<usb::UsbDevice>& bus) {
  std::vector<Connected> list;
  std::set<std::string> ports;
  for (const v4l2::VideoSystem::Node& node : video.nodes()) {
    // Only nodes that capture; and a camera with several of them is listed once.
    if (!v4l2::find_camera(video, {v4l2::CameraName::By::node, node.path})) continue;
    if (!node.usb_path.empty() && !ports.insert(node.usb_path).second) continue;
    Connected camera{"v4l2",       "v4l2:" + v4l2::text(v4l2::lasting_name(video, node)),
                     node.product, node.serial,
                     node.path,    {}};
    for (const usb::UsbDevice& device : bus) {
      if (device.path == node.usb_path) camera.remark = remark_on(device);
    }
    list.push_back(std::move(camera));
  }
  for (const usb::UsbDevice& device : bus) {
    if (!device.is_camera || ports.count(device.path)) continue;
    list.push_back({"usb", "", device.model.empty() ? device.id() : device.model, device.serial,
                    "usb:" + device.path,
                    "no video node: photos come through stills:FOLDER; a video camera needs the "
                    "uvcvideo module"});
  }
  return list;
}

std::vector<Connected> network_cameras() {
  std::vector<Connected> list;
  for (const aravis::FoundCamera& found : aravis::discover()) {
    list.push_back({"aravis", "aravis:" + found.id, found.model, found.serial, found.address, {}});
  }
  return list;
}

std::vector<Connected> added(const std::vector<Connected>& before,
                             const std::vector<Connected>& after) {
  std::vector<Connected> list;
  for (const Connected& camera : after) {
    if (std::find(before.begin(), before.end(), camera) == before.end()) list.push_back(camera);
  }
  return list;
}

}  // namespace orbitfuse::recording
