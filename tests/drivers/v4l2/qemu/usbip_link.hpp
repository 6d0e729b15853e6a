// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "tests/drivers/v4l2/qemu/uvc_descriptors.hpp"

namespace orbitfuse::v4l2::guest {

/// The device's end of usbip (Linux Documentation/usb/usbip_protocol.rst). The other end of a
/// socket pair is given to vhci_hcd, the kernel's virtual USB host controller; there is no network.
class UsbipLink {
 public:
  UsbipLink();  ///< throws std::runtime_error when there is no vhci_hcd or no port is free
  ~UsbipLink() { unplug(); }
  UsbipLink(const UsbipLink&) = delete;
  UsbipLink& operator=(const UsbipLink&) = delete;

  /// A request of the host: a transfer, or the wish to forget one.
  struct Request {
    bool unlink = false;
    std::uint32_t number = 0;           ///< of the transfer; of the unlink itself
    std::uint32_t unlinked_number = 0;  ///< the transfer to forget
    std::uint32_t endpoint = 0;
    bool in = false;
    std::uint32_t length = 0;
    std::array<std::uint8_t, 8> setup{};
    Bytes data;  ///< of an OUT transfer
  };
  /// Nothing within the time; plugged() tells whether the host is still there.
  std::optional<Request> receive(int timeout_ms);
  /// `status` 0 or a negative errno; the data of an IN transfer.
  void answer(const Request& transfer, int status, const Bytes& data = {});
  void answer_unlink(const Request& unlink, bool was_pending);

  bool plugged() const { return fd_ >= 0; }
  void unplug();

 private:
  bool read_all(void* to, std::size_t count);
  void send(const Bytes& bytes);

  int fd_ = -1;
};

}  // namespace orbitfuse::v4l2::guest
