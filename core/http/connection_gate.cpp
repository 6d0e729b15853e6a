// SPDX-License-Identifier: BSD-3-Clause
#include "core/http/connection_gate.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <condition_variable>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

namespace orbitfuse {
namespace {

using Clock = std::chrono::steady_clock;

/// After the answer: for bytes still under way, which would otherwise reset the connection.
constexpr std::chrono::milliseconds farewell{300};

struct Connection {
  enum class State { reading, answering, writing, leaving } state = State::reading;
  int fd = -1;
  Clock::time_point deadline;
  Clock::time_point answered;  ///< when the answer's first byte could go
  std::string request, answer;
  std::size_t sent = 0;
  std::shared_ptr<std::atomic<bool>> gone = std::make_shared<std::atomic<bool>>(false);
};

struct WholeRequest {
  std::uint64_t key = 0;
  std::string text;
  std::shared_ptr<std::atomic<bool>> gone;
};

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

}  // namespace

std::optional<std::size_t> request_size(const std::string& begun) {
  const std::size_t end = begun.find("\r\n\r\n");
  if (end == std::string::npos) return std::nullopt;
  const std::string head = lower(begun.substr(0, end));
  const std::string key = "\r\ncontent-length:";
  const std::size_t at = head.find(key);
  const std::size_t body =
      at == std::string::npos ? 0 : std::strtoull(head.c_str() + at + key.size(), nullptr, 10);
  return end + 4 + std::min<std::size_t>(body, std::size_t{1} << 30);
}

struct ConnectionGate::Impl {
  Impl(int socket, GateLimits l, Answer a) : listener(socket), limits(l), answer(std::move(a)) {}

  int listener;
  GateLimits limits;
  Answer answer;
  int wake = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  std::map<std::uint64_t, Connection> connections;  ///< by age; of the reading thread only
  std::uint64_t next_key = 0;

  std::mutex mutex;
  std::condition_variable changed;
  std::deque<WholeRequest> requests;
  std::deque<std::pair<std::uint64_t, std::string>> answers;
  bool over = false;
  std::vector<std::thread> threads;

  void wake_up() const {
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = ::write(wake, &one, sizeof one);
  }

  void work() {
    while (true) {
      WholeRequest request;
      {
        std::unique_lock lock(mutex);
        changed.wait(lock, [&] { return over || !requests.empty(); });
        if (over) return;
        request = std::move(requests.front());
        requests.pop_front();
      }
      std::string text = answer(request.text, *request.gone);
      {
        const std::lock_guard lock(mutex);
        answers.emplace_back(request.key, std::move(text));
      }
      wake_up();
    }
  }

  void forget(std::map<std::uint64_t, Connection>::iterator connection) {
    ::close(connection->second.fd);
    connections.erase(connection);
  }

  /// Who has been at its request longest goes; a whole request is answered first.
  bool make_room() {
    if (connections.size() < limits.connections) return true;
    for (const auto state :
         {Connection::State::leaving, Connection::State::reading, Connection::State::writing}) {
      const auto oldest = std::find_if(connections.begin(), connections.end(),
                                       [&](const auto& c) { return c.second.state == state; });
      if (oldest == connections.end()) continue;
      forget(oldest);
      return true;
    }
    return false;
  }

  void accept_all() {
    while (true) {
      const int fd = ::accept4(listener, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
      if (fd < 0) return;
      if (!make_room()) {
        ::close(fd);
        return;
      }
      Connection connection;
      connection.fd = fd;
      connection.deadline = Clock::now() + limits.request;
      connections.emplace(next_key++, std::move(connection));
    }
  }

  void hand_on(std::uint64_t key, Connection& c) {
    c.state = Connection::State::answering;
    const std::lock_guard lock(mutex);
    requests.push_back({key, std::move(c.request), c.gone});
    changed.notify_one();
  }

  void say(Connection& c, std::string text) {
    c.answer = std::move(text);
    c.state = Connection::State::writing;
    c.answered = Clock::now();
    c.deadline = c.answered + limits.answer;
  }

  /// False when the connection is over.
  bool read(std::uint64_t key, Connection& c) {
    std::array<char, 4096> bytes;
    const ssize_t count = ::recv(c.fd, bytes.data(), bytes.size(), 0);
    if (count < 0) return errno == EAGAIN || errno == EINTR;
    if (count == 0) return false;
    if (c.state == Connection::State::leaving) return true;
    c.request.append(bytes.data(), static_cast<std::size_t>(count));
    const std::optional<std::size_t> size = request_size(c.request);
    if (std::max(size.value_or(0), c.request.size()) > limits.request_bytes) {
      say(c, "HTTP/1.1 413 Payload Too Large\r\nConnection: close\r\nContent-Length: 0\r\n\r\n");
    } else if (size && c.request.size() >= *size) {
      hand_on(key, c);
    }
    return true;
  }

  bool write(Connection& c) const {
    const ssize_t count =
        ::send(c.fd, c.answer.data() + c.sent, c.answer.size() - c.sent, MSG_NOSIGNAL);
    if (count < 0) return errno == EAGAIN || errno == EINTR;
    c.sent += static_cast<std::size_t>(count);
    c.deadline = c.answered + limits.answer +
                 std::chrono::milliseconds(1000 * c.sent / limits.least_bytes_per_s);
    if (c.sent < c.answer.size()) return true;
    ::shutdown(c.fd, SHUT_WR);
    c.state = Connection::State::leaving;
    c.deadline = Clock::now() + farewell;
    return true;
  }

  void take_answers() {
    std::uint64_t count = 0;
    [[maybe_unused]] const ssize_t drained = ::read(wake, &count, sizeof count);
    std::deque<std::pair<std::uint64_t, std::string>> ready;
    {
      const std::lock_guard lock(mutex);
      ready.swap(answers);
    }
    for (auto& [key, text] : ready) {
      const auto connection = connections.find(key);
      if (connection == connections.end()) continue;
      if (text.empty())
        forget(connection);
      else
        say(connection->second, std::move(text));
    }
  }

  void serve() {
    std::vector<pollfd> waiters;
    std::vector<std::uint64_t> keys;
    while (true) {
      {
        const std::lock_guard lock(mutex);
        if (over) break;
      }
      waiters = {{wake, POLLIN, 0}, {listener, POLLIN, 0}};
      keys.clear();
      for (const auto& [key, c] : connections) {
        const bool writing = c.state == Connection::State::writing;
        const bool answering = c.state == Connection::State::answering;
        // While an answer is made only its peer's leaving is of interest, and that once.
        const int wanted = writing ? POLLOUT : answering ? POLLRDHUP : POLLIN;
        waiters.push_back({answering && *c.gone ? -1 : c.fd, static_cast<short>(wanted), 0});
        keys.push_back(key);
      }
      ::poll(waiters.data(), waiters.size(), 100);
      for (std::size_t i = 0; i < keys.size(); ++i) {
        const auto found = connections.find(keys[i]);
        Connection& c = found->second;
        bool stays = true;
        if (waiters[i + 2].revents != 0 && c.state == Connection::State::answering)
          *c.gone = true;
        else if (waiters[i + 2].revents != 0)
          stays = c.state == Connection::State::writing ? write(c) : read(keys[i], c);
        const bool late = c.state != Connection::State::answering && Clock::now() > c.deadline;
        if (!stays || late) forget(found);
      }
      take_answers();
      if (waiters[1].revents != 0) accept_all();
    }
    for (const auto& [key, c] : connections) *c.gone = true;
  }
};

ConnectionGate::ConnectionGate(int listening_socket, GateLimits limits, Answer answer)
    : impl_(std::make_unique<Impl>(listening_socket, limits, std::move(answer))) {
  ::listen(listening_socket, 64);  // a burst waits there rather than for a second try
  ::fcntl(listening_socket, F_SETFL, O_NONBLOCK);
  impl_->threads.emplace_back([impl = impl_.get()] { impl->serve(); });
  for (int i = 0; i < limits.workers; ++i)
    impl_->threads.emplace_back([impl = impl_.get()] { impl->work(); });
}

ConnectionGate::~ConnectionGate() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->over = true;
    impl_->changed.notify_all();
  }
  impl_->wake_up();
  for (std::thread& thread : impl_->threads) thread.join();
  for (const auto& [key, connection] : impl_->connections) ::close(connection.fd);
  ::close(impl_->listener);
  ::close(impl_->wake);
}

}  // namespace orbitfuse
