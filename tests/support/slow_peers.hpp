// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <thread>
#include <vector>

// Peers of a page that behave as no browser does.
namespace orbitfuse::test {

/// A socket connected to a port of this machine; -1: refused.
inline int connected_to(int port) {
  const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0) return fd;
  ::close(fd);
  return -1;
}

/// Listens on a free port of this machine; who connects hears nothing.
class SilentListener {
 public:
  SilentListener() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* const at = reinterpret_cast<sockaddr*>(&address);
    if (::bind(fd_, at, size) == 0 && ::listen(fd_, 4) == 0 && ::getsockname(fd_, at, &size) == 0)
      port_ = ntohs(address.sin_port);
  }
  SilentListener(const SilentListener&) = delete;
  SilentListener& operator=(const SilentListener&) = delete;
  ~SilentListener() { ::close(fd_); }
  int port() const { return port_; }  ///< 0: none was free

 private:
  int fd_ = ::socket(AF_INET, SOCK_STREAM, 0), port_ = 0;
};

/// The answer to a request that is sent as it stands here, without closing the connection.
inline std::string answer_to(int port, const std::string& request, int patience_ms = 3000) {
  const int fd = connected_to(port);
  std::string answer;
  if (fd >= 0 &&
      ::send(fd, request.data(), request.size(), 0) == static_cast<ssize_t>(request.size())) {
    char bytes[4096];
    pollfd ready{fd, POLLIN, 0};
    while (::poll(&ready, 1, patience_ms) > 0) {
      const ssize_t count = ::recv(fd, bytes, sizeof bytes, 0);
      if (count <= 0) break;
      answer.append(bytes, static_cast<std::size_t>(count));
    }
  }
  ::close(fd);
  return answer;
}

/// Peers that send a byte now and then, or nothing, or never read.
class SlowPeers {
 public:
  SlowPeers(int port, int count) {
    for (int i = 0; i < count; ++i) {
      if (const int fd = connected_to(port); fd >= 0) fds_.push_back(fd);
    }
    drip_ = std::jthread([this](const std::stop_token& over) {
      const std::string request =
          "GET /state HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Slow: " + std::string(4000, 'x');
      for (std::size_t at = 0; !over.stop_requested() && at < request.size(); ++at) {
        for (const int fd : fds_) (void)!::send(fd, &request[at], 1, MSG_NOSIGNAL);
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      }
    });
  }
  ~SlowPeers() {
    drip_ = {};
    for (const int fd : fds_) ::close(fd);
  }
  std::size_t count() const { return fds_.size(); }

 private:
  std::vector<int> fds_;
  std::jthread drip_;
};

}  // namespace orbitfuse::test
