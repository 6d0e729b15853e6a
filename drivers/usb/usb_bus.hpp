// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace orbitfuse::usb {

/// One device on the bus. Strings may be empty: not every device has them.
struct UsbDevice {
  std::uint16_t vendor = 0, product = 0;
  std::string manufacturer, model, serial;
  std::string path;   ///< the port, "bus-port.port", e.g. "1-4.2"; stays when it is replugged there
  int megabit_s = 0;  ///< negotiated speed; a USB 3 camera at 480 hangs on a bad cable
  bool is_camera = false;  ///< has a video (UVC), USB3 Vision or still-image (PTP) interface

  std::string id() const;  ///< "046d:0825"
  /// The same piece of hardware, wherever it is plugged in; without serial, the same port.
  bool same_as(const UsbDevice& other) const;
};

/// The bus, as a seam: tests plug and unplug.
class UsbBus {
 public:
  virtual ~UsbBus() = default;
  virtual Result<std::vector<UsbDevice>> list() = 0;
  /// Returns early when something may have been plugged or unplugged.
  virtual void wait(std::chrono::milliseconds timeout) = 0;
  /// Resets the port as if the device had been replugged; a hung camera comes back under the same
  /// or another node. Device error with the remedy when that is not allowed or nothing is there.
  virtual Status reset(const std::string& path) = 0;
};

/// libusb's; unavailable when the machine has no USB.
Result<std::unique_ptr<UsbBus>> make_usb_bus();

/// manufacturer, model and serial as the kernel read them; needs no permission, unlike asking the
/// device. `root` is /sys/bus/usb/devices.
void read_strings(const std::filesystem::path& root, UsbDevice& device);

}  // namespace orbitfuse::usb
