// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/v4l2/identity.hpp"

#include <fcntl.h>
#include <linux/videodev2.h>

#include <array>
#include <optional>
#include <utility>

namespace orbitfuse::v4l2 {
namespace {

constexpr std::array<std::pair<const char*, CameraName::By>, 3> prefixes{
    {{"serial:", CameraName::By::serial},
     {"usb:", CameraName::By::usb_path},
     {"id:", CameraName::By::usb_id}}};

bool matches(const VideoSystem::Node& node, const CameraName& name) {
  switch (name.by) {
    case CameraName::By::node:
      return node.path == name.value;
    case CameraName::By::serial:
      return node.serial == name.value;
    case CameraName::By::usb_path:
      return node.usb_path == name.value;
    case CameraName::By::usb_id:
      return node.usb_id == name.value;
  }
  return false;
}

bool is_capture_node(VideoSystem& system, const std::string& path) {
  const int fd = system.open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return true;  // let the open of the source say why it cannot be used
  v4l2_capability capability{};
  const bool answered = system.ioctl(fd, VIDIOC_QUERYCAP, &capability) == 0;
  system.close(fd);
  const unsigned caps = capability.capabilities & V4L2_CAP_DEVICE_CAPS ? capability.device_caps
                                                                       : capability.capabilities;
  return answered && (caps & V4L2_CAP_VIDEO_CAPTURE) && (caps & V4L2_CAP_STREAMING);
}

bool like(const VideoSystem::Node& a, const VideoSystem::Node& b) {
  return a.usb_id == b.usb_id && a.serial == b.serial && a.function == b.function;
}

}  // namespace

Result<CameraName> parse_camera_name(const std::string& text) {
  for (const auto& [prefix, by] : prefixes) {
    const std::string start = prefix;
    if (text.starts_with(start) && text.size() > start.size()) {
      return CameraName{by, text.substr(start.size())};
    }
  }
  if (text.starts_with("/dev/")) return CameraName{CameraName::By::node, text};
  return fail(ErrorKind::usage, "camera \"" + text + "\"", "not a camera name",
              "use /dev/videoN, serial:S, usb:PORT or id:VENDOR:PRODUCT (see orbitfuse devices)");
}

Result<VideoSystem::Node> find_camera(VideoSystem& system, const CameraName& name) {
  std::string seen;
  for (const VideoSystem::Node& node : system.nodes()) {
    if (matches(node, name) && is_capture_node(system, node.path)) return node;
    seen += (seen.empty() ? "" : ", ") + node.path + " (" + node.product + ")";
  }
  // A node without sysfs entry (a container, a test) may still open.
  if (name.by == CameraName::By::node && seen.empty()) {
    return VideoSystem::Node{.path = name.value,
                             .serial = {},
                             .usb_path = {},
                             .usb_id = {},
                             .product = {},
                             .function = {}};
  }
  return fail(ErrorKind::device, "camera " + text(name),
              seen.empty() ? "no video device is connected" : "not connected; there is " + seen,
              "plug it in, or name another (orbitfuse devices)");
}

CameraIdentity identity_of(VideoSystem& system, const VideoSystem::Node& node) {
  CameraIdentity identity{node, node.serial.empty()};
  identity.port_only |= look_alike(system, identity).has_value();
  return identity;
}

CameraName lasting_name(VideoSystem& system, const VideoSystem::Node& node) {
  if (node.usb_path.empty()) return {CameraName::By::node, node.path};
  if (identity_of(system, node).port_only) return {CameraName::By::usb_path, node.usb_path};
  return {CameraName::By::serial, node.serial};
}

Result<VideoSystem::Node> find_again(VideoSystem& system, const CameraIdentity& camera) {
  const VideoSystem::Node& node = camera.node;
  if (node.usb_path.empty()) return find_camera(system, {CameraName::By::node, node.path});
  std::optional<VideoSystem::Node> found;
  for (const VideoSystem::Node& candidate : system.nodes()) {
    const bool same_port = candidate.usb_path == node.usb_path;
    if (!like(candidate, node) || (camera.port_only && !same_port)) continue;
    if ((found && !same_port) || !is_capture_node(system, candidate.path)) continue;
    found = candidate;
    if (same_port) break;
  }
  if (found) return *found;
  return fail(ErrorKind::device, "camera " + node.product + " at usb:" + node.usb_path,
              "not connected", "plug it in again, into the same port");
}

std::optional<VideoSystem::Node> look_alike(VideoSystem& system, const CameraIdentity& camera,
                                            const std::string& except_port) {
  for (const VideoSystem::Node& node : system.nodes()) {
    if (like(node, camera.node) && node.usb_path != camera.node.usb_path &&
        node.usb_path != except_port)
      return node;
  }
  return std::nullopt;
}

std::string text(const CameraName& name) {
  for (const auto& [prefix, by] : prefixes) {
    if (by == name.by) return prefix + name.value;
  }
  return name.value;
}

}  // namespace orbitfuse::v4l2
