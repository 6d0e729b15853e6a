// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "drivers/usb/usb_bus.hpp"

namespace orbitfuse::usb {

struct UsbChange {
  enum class Kind { arrived, left, moved };  ///< moved: the same hardware in another port
  Kind kind = Kind::arrived;
  UsbDevice device;         ///< as it is now; of `left` as it was
  std::string former_path;  ///< of `moved`
};

/// What happened between two listings.
std::vector<UsbChange> changes(const std::vector<UsbDevice>& before,
                               const std::vector<UsbDevice>& after);

/// Follows the bus by comparing listings, so that no event is missed when two fall together.
class UsbWatch {
 public:
  explicit UsbWatch(UsbBus& bus) : bus_(bus) {}
  /// The first call tells every device as arrived. Waits at most `timeout` for a change.
  Result<std::vector<UsbChange>> next(std::chrono::milliseconds timeout);

 private:
  UsbBus& bus_;
  bool first_ = true;
  std::vector<UsbDevice> known_;
};

/// A camera by "serial:S", "usb:PORT" or "id:VVVV:PPPP", resets its port and waits until it is
/// listed again. Device error when it is not there, is not unique or does not come back in time.
Status reset_camera(UsbBus& bus, const std::string& name, std::chrono::milliseconds patience);

}  // namespace orbitfuse::usb
