// SPDX-License-Identifier: BSD-3-Clause
#include "tests/drivers/v4l2/qemu/usbip_link.hpp"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

namespace orbitfuse::v4l2::guest {
namespace {

const std::string host_controller = "/sys/devices/platform/vhci_hcd.0/";
constexpr int high_speed = 3;    // enum usb_device_speed
constexpr int port_is_free = 4;  // VDEV_ST_NULL

constexpr std::size_t header_words = 12;
using Header = std::array<std::uint32_t, header_words>;  // big-endian on the wire
enum Command : std::uint32_t { submit = 1, unlink = 2, submitted = 3, unlinked = 4 };

int free_high_speed_port() {
  std::ifstream table(host_controller + "status");
  for (std::string line; std::getline(table, line);) {
    std::istringstream fields(line);
    std::string hub;
    int port = 0, state = 0;
    if (fields >> hub >> port >> state && hub == "hs" && state == port_is_free) return port;
  }
  throw std::runtime_error("no free port in " + host_controller + "status");
}

Bytes wire(const Header& header) {
  Bytes bytes(sizeof header);
  for (std::size_t i = 0; i < header_words; ++i) {
    const std::uint32_t word = htonl(header[i]);
    std::memcpy(bytes.data() + 4 * i, &word, 4);
  }
  return bytes;
}

}  // namespace

UsbipLink::UsbipLink() {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM, 0, ends) != 0) throw std::runtime_error("no socket pair");
  fd_ = ends[0];
  const int port = free_high_speed_port();
  std::ofstream attach(host_controller + "attach");
  attach << port << ' ' << ends[1] << ' ' << (1 << 16 | (port + 2)) << ' ' << high_speed
         << std::flush;
  const bool attached = attach.good();
  ::close(ends[1]);  // the kernel has its own
  if (!attached) throw std::runtime_error("vhci_hcd did not take the device");
}

bool UsbipLink::read_all(void* to, std::size_t count) {
  return ::recv(fd_, to, count, MSG_WAITALL) == static_cast<ssize_t>(count);
}

std::optional<UsbipLink::Request> UsbipLink::receive(int timeout_ms) {
  if (!plugged()) return std::nullopt;
  pollfd waiter{fd_, POLLIN, 0};
  if (::poll(&waiter, 1, timeout_ms) <= 0) return std::nullopt;
  Header header{};
  if (!read_all(header.data(), sizeof header)) {
    unplug();
    return std::nullopt;
  }
  Request request;
  std::memcpy(request.setup.data(), &header[10], 8);
  for (std::uint32_t& word : header) word = ntohl(word);
  request.unlink = header[0] == unlink;
  request.number = header[1];
  request.in = header[3] == 1;
  request.endpoint = header[4];
  if (request.unlink) {
    request.unlinked_number = header[5];
    return request;
  }
  request.length = header[6];
  if (!request.in) {
    request.data.resize(request.length);
    if (request.length > 0 && !read_all(request.data.data(), request.length)) unplug();
  }
  return request;
}

void UsbipLink::answer(const Request& transfer, int status, const Bytes& data) {
  const auto count = static_cast<std::uint32_t>(transfer.in ? data.size() : transfer.data.size());
  Header header{submitted, transfer.number};
  header[5] = static_cast<std::uint32_t>(status);
  header[6] = status == 0 ? count : 0;
  Bytes message = wire(header);
  if (transfer.in && status == 0) message.insert(message.end(), data.begin(), data.end());
  send(message);
}

void UsbipLink::answer_unlink(const Request& request, bool was_pending) {
  Header header{unlinked, request.number};
  header[5] = static_cast<std::uint32_t>(was_pending ? -ECONNRESET : 0);
  send(wire(header));
}

void UsbipLink::send(const Bytes& bytes) {
  std::size_t sent = 0;
  while (plugged() && sent < bytes.size()) {
    const ssize_t count = ::send(fd_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (count <= 0)
      unplug();
    else
      sent += static_cast<std::size_t>(count);
  }
}

void UsbipLink::unplug() {
  if (fd_ < 0) return;
  ::shutdown(fd_, SHUT_RDWR);
  ::close(fd_);
  fd_ = -1;
}

}  // namespace orbitfuse::v4l2::guest
