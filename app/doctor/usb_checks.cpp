// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "app/doctor/checks.hpp"
#include "app/doctor/kernel_files.hpp"

namespace orbitfuse::doctor {
namespace {

constexpr long long wanted_usbfs_mb =
    256;  // the kernel's 16 MB hold less than one USB3 Vision burst

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
  return list;
}

}  // namespace orbitfuse::doctor
