// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>

#include "app/doctor/checks.hpp"
#include "app/doctor/kernel_files.hpp"

namespace orbitfuse::doctor {
namespace {

constexpr long long usb2_megabit_s = 480;

constexpr long long wanted_usbfs_mb =
    256;  // the kernel's 16 MB hold less than one USB3 Vision burst

/// Cameras by bus, from the kernel's list: a camera has a video interface (class 0e) in a folder
/// such as "1-4.2:1.0".
struct Bus {
  std::vector<std::string> cameras;
  long long slowest_megabit_s = 0;
};
std::map<std::string, Bus> camera_buses(const std::filesystem::path& devices) {
  std::map<std::string, Bus> buses;
  std::set<std::string> seen;
  for (const std::string& name : names_in(devices)) {
    const std::size_t colon = name.find(':'), dash = name.find('-');
    if (colon == std::string::npos || dash == std::string::npos) continue;
    if (line_of(devices / name / "bInterfaceClass") != "0e") continue;
    const std::string device = name.substr(0, colon);
    if (!seen.insert(device).second) continue;
    const long long speed = number_of(devices / device / "speed").value_or(0);
    Bus& bus = buses[name.substr(0, dash)];
    bus.cameras.push_back(fmt::format(
        "{} ({} Mbit/s)", line_of(devices / device / "product").value_or(device), speed));
    if (speed > 0)
      bus.slowest_megabit_s =
          bus.slowest_megabit_s > 0 ? std::min(bus.slowest_megabit_s, speed) : speed;
  }
  return buses;
}

Finding check_bus(const std::string& number, const Bus& bus) {
  Finding finding{"USB bus " + number, fmt::format("{}", fmt::join(bus.cameras, ", ")), "", false};
  if (bus.slowest_megabit_s > 0 && bus.slowest_megabit_s < usb2_megabit_s) {
    finding.remedy = "too slow for video: use another port or cable, and no hub of USB 1";
  } else if (bus.cameras.size() > 1 && bus.slowest_megabit_s == usb2_megabit_s) {
    finding.remedy =
        "cameras on one USB 2 bus share some 300 Mbit/s; 640x480 YUYV at 30 Hz takes 147: plug one "
        "into a port of "
        "another bus (lsusb -t), or use format=MJPG or a lower rate";
  }
  return finding;
}

}  // namespace

std::vector<Finding> check_usb(const Machine& machine) {
  namespace fs = std::filesystem;
  std::vector<Finding> list;
  const fs::path parameters = machine.root / "sys/module/usbcore/parameters";
  if (const auto mb = number_of(parameters / "usbfs_memory_mb")) {
    // 0 means no limit.
    const bool enough = *mb == 0 || *mb >= wanted_usbfs_mb;
    list.push_back(
        {"USB memory", *mb == 0 ? "no limit" : fmt::format("usbfs_memory_mb {}", *mb),
         enough
             ? ""
             : "for USB3 Vision cameras: echo 256 > /sys/module/usbcore/parameters/usbfs_memory_mb",
         false});
  }
  if (const auto seconds = number_of(parameters / "autosuspend"); seconds && *seconds >= 0) {
    list.push_back({"USB power", fmt::format("idle devices sleep after {} s", *seconds),
                    "cameras that hang after a pause: boot with usbcore.autosuspend=-1", false});
  }
  std::error_code ignored;
  const std::vector<std::string> nodes = names_in(machine.root / "sys/class/video4linux");
  const bool has_uvc = fs::exists(machine.root / "sys/module/uvcvideo", ignored);
  if (fs::exists(machine.root / "sys/bus/usb", ignored)) {
    list.push_back(
        {"video cameras",
         fmt::format("{} nodes, uvcvideo {}", nodes.size(), has_uvc ? "loaded" : "not loaded"),
         has_uvc || !nodes.empty() ? "" : "for USB cameras: modprobe uvcvideo", false});
  }
  for (const auto& [number, bus] : camera_buses(machine.root / "sys/bus/usb/devices"))
    list.push_back(check_bus(number, bus));
  return list;
}

}  // namespace orbitfuse::doctor
