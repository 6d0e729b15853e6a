// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/usb/usb_watch.hpp"

#include <algorithm>

namespace orbitfuse::usb {
namespace {

using Clock = std::chrono::steady_clock;

const UsbDevice* find(const std::vector<UsbDevice>& devices, const UsbDevice& wanted,
                      bool same_port) {
  for (const UsbDevice& d : devices) {
    if (d.same_as(wanted) && (d.path == wanted.path) == same_port) return &d;
  }
  return nullptr;
}

bool is_named(const UsbDevice& device, const std::string& name) {
  return name == "serial:" + device.serial || name == "usb:" + device.path ||
         name == "id:" + device.id();
}

}  // namespace

std::vector<UsbChange> changes(const std::vector<UsbDevice>& before,
                               const std::vector<UsbDevice>& after) {
  std::vector<UsbChange> list;
  for (const UsbDevice& d : before) {
    if (!find(after, d, true) && !find(after, d, false))
      list.push_back({UsbChange::Kind::left, d, {}});
  }
  for (const UsbDevice& d : after) {
    if (find(before, d, true)) continue;
    const UsbDevice* former = find(before, d, false);
    // Cheap cameras share one serial: a second one of them is a new device, not a moved one.
    if (former && !find(after, *former, true))
      list.push_back({UsbChange::Kind::moved, d, former->path});
    else
      list.push_back({UsbChange::Kind::arrived, d, {}});
  }
  return list;
}

Result<std::vector<UsbChange>> UsbWatch::next(std::chrono::milliseconds timeout) {
  if (!first_) bus_.wait(timeout);
  first_ = false;
  ORBITFUSE_ASSIGN(std::vector<UsbDevice> now, bus_.list());
  std::vector<UsbChange> list = changes(known_, now);
  known_ = std::move(now);
  return list;
}

Status reset_camera(UsbBus& bus, const std::string& name, std::chrono::milliseconds patience) {
  ORBITFUSE_ASSIGN(const std::vector<UsbDevice> devices, bus.list());
  const auto fits = [&](const UsbDevice& d) { return is_named(d, name); };
  const auto camera = std::find_if(devices.begin(), devices.end(), fits);
  if (camera == devices.end()) {
    return fail(ErrorKind::device, "USB device " + name, "not connected",
                "plug it in, or name another (orbitfuse devices)");
  }
  if (std::count_if(devices.begin(), devices.end(), fits) > 1) {
    return fail(ErrorKind::device, "USB device " + name, "several of them are connected",
                "name it by its port, usb:PORT");
  }
  ORBITFUSE_TRY(bus.reset(camera->path));
  const auto deadline = Clock::now() + patience;
  do {
    ORBITFUSE_ASSIGN(const std::vector<UsbDevice> now, bus.list());
    if (std::any_of(now.begin(), now.end(), [&](const UsbDevice& d) { return d.same_as(*camera); }))
      return {};
    bus.wait(std::chrono::milliseconds(100));
  } while (Clock::now() < deadline);
  return fail(ErrorKind::device, "USB device " + name, "did not come back after the reset",
              "unplug it and plug it in again");
}

}  // namespace orbitfuse::usb
