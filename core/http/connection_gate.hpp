// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace orbitfuse {

struct GateLimits {
  std::size_t connections = 64;       ///< the one that has been at its request longest makes room
  std::size_t request_bytes = 16384;  ///< head and body
  std::chrono::milliseconds request{3000};  ///< from the connection to the request's last byte
  /// From the answer's first byte to its last, and for what has gone the time it takes at
  /// `least_bytes_per_s`: a large answer over a slow network arrives, a peer that stops does not
  /// stay.
  std::chrono::milliseconds answer{5000};
  std::size_t least_bytes_per_s = 16 << 10;
  int workers = 4;
};

/// Stands between the network and whoever answers requests. One thread reads all connections and
/// hands on whole requests only, so that slow or silent peers hold up nobody; each connection
/// carries one request, has a deadline, and their number is bounded. Stopping waits for no peer.
class ConnectionGate {
 public:
  /// The answer, head and body, to a request; called from the workers' threads. `gone` turns true
  /// when nobody waits for it any more: the peer closed, or the gate is stopping.
  using Answer =
      std::function<std::string(const std::string& request, const std::atomic<bool>& gone)>;

  /// Takes the listening socket.
  ConnectionGate(int listening_socket, GateLimits limits, Answer answer);
  ~ConnectionGate();
  ConnectionGate(const ConnectionGate&) = delete;
  ConnectionGate& operator=(const ConnectionGate&) = delete;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// How many bytes the request that begins like this has; nothing while its head is not complete.
std::optional<std::size_t> request_size(const std::string& begun);

}  // namespace orbitfuse
