// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/aravis/gvcp_probe.hpp"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdint>

namespace orbitfuse::aravis {

bool answers(const std::string& ip_address, std::chrono::milliseconds timeout) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(3956);
  if (inet_pton(AF_INET, ip_address.c_str(), &to.sin_addr) != 1) return false;
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return false;
  // Key 0x42, acknowledge wanted, DISCOVERY_CMD, no payload, request id 0x6f66.
  const std::array<std::uint8_t, 8> request{0x42, 0x01, 0x00, 0x02, 0x00, 0x00, 0x6f, 0x66};
  bool answered = false;
  if (sendto(fd, request.data(), request.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof to) > 0) {
    pollfd waiter{fd, POLLIN, 0};
    std::array<std::uint8_t, 512> reply{};
    answered = poll(&waiter, 1, static_cast<int>(timeout.count())) > 0 &&
               recv(fd, reply.data(), reply.size(), 0) >= 8 && reply[3] == 0x03 && reply[6] == 0x6f && reply[7] == 0x66;
  }
  close(fd);
  return answered;
}

}  // namespace orbitfuse::aravis
