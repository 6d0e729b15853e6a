// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/aravis/gvcp_probe.hpp"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdint>

namespace orbitfuse::aravis {

namespace {

using Reply = std::array<std::uint8_t, 512>;

/// Sends one request of id 0x6f66 and returns what came back; nothing: none came.
std::span<const std::uint8_t> ask(const std::string& ip_address, const void* request,
                                  std::size_t size, std::chrono::milliseconds timeout,
                                  Reply& reply) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(3956);
  if (inet_pton(AF_INET, ip_address.c_str(), &to.sin_addr) != 1) return {};
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return {};
  ssize_t received = 0;
  if (sendto(fd, request, size, 0, reinterpret_cast<sockaddr*>(&to), sizeof to) > 0) {
    pollfd waiter{fd, POLLIN, 0};
    if (poll(&waiter, 1, static_cast<int>(timeout.count())) > 0)
      received = recv(fd, reply.data(), reply.size(), 0);
  }
  close(fd);
  if (received <= 0) return {};
  return std::span<const std::uint8_t>(reply).first(static_cast<std::size_t>(received));
}

bool is_ours(std::span<const std::uint8_t> datagram) {
  return datagram.size() >= 8 && datagram[6] == 0x6f && datagram[7] == 0x66;
}

}  // namespace

bool is_discovery_answer(std::span<const std::uint8_t> datagram) {
  return is_ours(datagram) && datagram[3] == 0x03;
}

std::optional<std::uint32_t> register_in_answer(std::span<const std::uint8_t> d) {
  // READREG_ACK, status success.
  if (!is_ours(d) || d.size() < 12 || d[0] != 0 || d[1] != 0 || d[3] != 0x81) return std::nullopt;
  return std::uint32_t{d[8]} << 24 | std::uint32_t{d[9]} << 16 | std::uint32_t{d[10]} << 8 | d[11];
}

bool answers(const std::string& ip_address, std::chrono::milliseconds timeout) {
  // Key 0x42, acknowledge wanted, DISCOVERY_CMD, no payload, request id 0x6f66.
  const std::array<std::uint8_t, 8> request{0x42, 0x01, 0x00, 0x02, 0x00, 0x00, 0x6f, 0x66};
  Reply reply{};
  return is_discovery_answer(ask(ip_address, request.data(), request.size(), timeout, reply));
}

std::optional<std::uint32_t> read_register(const std::string& ip_address, GvcpRegister address,
                                           std::chrono::milliseconds timeout) {
  const auto a = static_cast<std::uint32_t>(address);
  const auto byte = [](std::uint32_t value, int shift) {
    return static_cast<std::uint8_t>(value >> shift);
  };
  // READREG_CMD of one address.
  const std::array<std::uint8_t, 12> request{0x42,        0x01,        0x00,       0x80,
                                             0x00,        0x04,        0x6f,       0x66,
                                             byte(a, 24), byte(a, 16), byte(a, 8), byte(a, 0)};
  Reply reply{};
  return register_in_answer(ask(ip_address, request.data(), request.size(), timeout, reply));
}

}  // namespace orbitfuse::aravis
