// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace orbitfuse::doctor {

/// One thing looked at. Without remedy it is fine; a finding that is `needed` fails the doctor,
/// any other is advice for cameras that this machine may never see.
struct Finding {
  std::string what, found, remedy;
  bool needed = false;
  ErrorKind kind = ErrorKind::unavailable;  ///< of the doctor's error, when it is needed
};

/// Where the kernel's files are read; tests give a folder of their own.
struct Machine {
  std::filesystem::path root = "/";
  /// Whether the kernel's clock is disciplined (adjtimex); absent: ask the kernel.
  std::optional<bool> clock_synchronised;
};

/// Link state and speed, MTU, multicast, subnets of wired interfaces; reverse path filter; receive
/// buffers. For GigE Vision cameras.
std::vector<Finding> check_network(const Machine& machine);
/// What a GigE Vision camera says of itself to anyone who asks.
struct CameraLink {
  std::string name, address;
  std::optional<int> packet_bytes = {};  ///< of its stream packets; absent: it didn't say
  bool controlled = false;               ///< by some program
  bool answers = true;                   ///< questions to its control port
};
/// Its packets against the MTU of the interface in its subnet, and whether it is free.
Finding check_camera(const Machine& machine, const CameraLink& camera);

/// Memory for USB transfers, power saving, the UVC driver, cameras that share a bus.
std::vector<Finding> check_usb(const Machine& machine);
/// The year, and whether a time service keeps the clock.
std::vector<Finding> check_clocks(const Machine& machine);
/// Free space and the rate of synced 1 MiB files in the folder. Writes and removes one file; in a
/// dry run it writes nothing and leaves out the rate.
Finding check_disk(const std::filesystem::path& folder, bool dry_run = false);

}  // namespace orbitfuse::doctor
