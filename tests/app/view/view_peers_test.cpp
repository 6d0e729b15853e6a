// SPDX-License-Identifier: BSD-3-Clause
// Many viewers, and peers that behave as no browser does: what others get, what it costs, how it
// ends.
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <atomic>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "app/view/shot_request.hpp"
#include "app/view/view_server.hpp"
#include "tests/app/view/toy_run.hpp"
#include "tests/support/slow_peers.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::view {
namespace {

using nlohmann::json;
using orbitfuse::test::answer_to;
using orbitfuse::test::connected_to;

constexpr const char* page_request = "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n";
constexpr const char* scene_request = "GET /scene HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n";
constexpr int patience_ms = 60'000;  // bounds a test that fails

bool good(const std::string& answer) { return answer.starts_with("HTTP/1.1 200"); }

/// Bytes have come that nobody has taken.
bool has_answer(int fd) {
  char byte = 0;
  return ::recv(fd, &byte, 1, MSG_PEEK | MSG_DONTWAIT) == 1;
}

/// Peers that ask for the page, some hundred kilobytes, and take nothing of it.
class PeersThatNeverRead {
 public:
  PeersThatNeverRead(int port, int count) {
    for (int i = 0; i < count; ++i) {
      const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
      const int little = 4096;  // or the kernel would take the page on the peer's behalf
      ::setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &little, sizeof little);
      sockaddr_in address{};
      address.sin_family = AF_INET;
      address.sin_port = htons(static_cast<std::uint16_t>(port));
      address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      const std::string request = page_request;
      if (::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0 &&
          ::send(fd, request.data(), request.size(), MSG_NOSIGNAL) > 0)
        fds.push_back(fd);
      else
        ::close(fd);
    }
  }
  ~PeersThatNeverRead() {
    for (const int fd : fds) ::close(fd);
  }
  PeersThatNeverRead(const PeersThatNeverRead&) = delete;
  PeersThatNeverRead& operator=(const PeersThatNeverRead&) = delete;

  std::vector<int> fds;
};

/// Of this process, bytes.
double resident() {
  std::ifstream file("/proc/self/statm");
  double total = 0, pages = 0;
  file >> total >> pages;
  return pages * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

class ViewPeersTest : public ::testing::Test {
 protected:
  void SetUp() override {
    FinishedRun run = test::toy_run(folder.path());
    const PosedView view = run.views[0].view;
    camera = browser_camera(view.camera, view.cam_from_world);
    PageOptions options;
    options.port = 0;
    server = std::make_unique<ViewServer>(std::move(run), options);
    ASSERT_TRUE(server->start());
  }
  std::string render_request(int viewer, int size) const {
    json asked = {
        {"client", "viewer " + std::to_string(viewer)}, {"width", size}, {"height", size}};
    for (const char* key : {"position", "rotation_wxyz", "fov_deg"}) asked[key] = camera.at(key);
    const std::string body = asked.dump();
    return "POST /render HTTP/1.1\r\nHost: 127.0.0.1\r\nX-OrbitFuse: 1\r\nContent-Length: " +
           std::to_string(body.size()) + "\r\n\r\n" + body;
  }

  orbitfuse::test::TempFolder folder;
  json camera;
  std::unique_ptr<ViewServer> server;
};

TEST_F(ViewPeersTest, WhoNeverReadsHoldsUpNobody) {
  const PeersThatNeverRead peers(server->port(), 20);
  ASSERT_EQ(peers.fds.size(), 20u);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(good(answer_to(server->port(), scene_request)));
  EXPECT_TRUE(good(answer_to(server->port(), render_request(0, 32), patience_ms)));
}

/// Twenty peers have each sent a part of their request when the others have been answered.
TEST_F(ViewPeersTest, WhoSendsAByteASecondHoldsUpNobody) {
  std::vector<int> peers;
  const auto drip = [&](const char* byte) {
    for (const int fd : peers) (void)!::send(fd, byte, 1, MSG_NOSIGNAL);
  };
  for (int i = 0; i < 20; ++i) peers.push_back(connected_to(server->port()));
  drip("G");
  int answered = 0;
  for (int i = 0; i < 3; ++i) answered += good(answer_to(server->port(), scene_request));
  drip("E");
  EXPECT_EQ(answered, 3);
  // No request was whole, so that none of them is being answered.
  for (const int fd : peers) EXPECT_FALSE(has_answer(fd));
  for (const int fd : peers) ::close(fd);
}

/// A large answer that is broken off after its first bytes, and a request in its middle.
TEST_F(ViewPeersTest, WhoClosesMidStreamHoldsUpNobody) {
  for (int i = 0; i < 20; ++i) {
    const int fd = connected_to(server->port());
    const std::string whole = i % 2 == 0 ? page_request : render_request(i, 64),
                      sent = i % 4 < 2 ? whole : whole.substr(0, whole.size() - 3);
    ASSERT_GT(::send(fd, sent.data(), sent.size(), MSG_NOSIGNAL), 0);
    char bytes[100];
    if (i % 4 == 0) {
      EXPECT_GT(::recv(fd, bytes, sizeof bytes, 0), 0);
    }
    ::close(fd);
  }
  EXPECT_TRUE(good(answer_to(server->port(), scene_request)));
  EXPECT_TRUE(good(answer_to(server->port(), render_request(0, 32), patience_ms)));
}

/// Ten viewers' pictures, while others can look at what is there.
TEST_F(ViewPeersTest, TenViewersAreAllRenderedFor) {
  std::vector<std::jthread> viewers;
  std::atomic<int> rendered{0};
  for (int v = 0; v < 10; ++v)
    viewers.emplace_back([&, v] {
      for (int n = 0; n < 2; ++n)
        rendered += good(answer_to(server->port(), render_request(v, 200 + v), patience_ms));
    });
  EXPECT_TRUE(good(answer_to(server->port(), scene_request, patience_ms)));
  viewers.clear();
  EXPECT_EQ(rendered, 20);
}

/// Each would hold a copy of the page; only so many connections are kept.
TEST_F(ViewPeersTest, MemoryDoesNotGrowWithPeersThatNeverRead) {
  const double page = static_cast<double>(answer_to(server->port(), page_request).size());
  ASSERT_GT(page, 300e3);
  constexpr int count = 400;
  const double before = resident();
  const PeersThatNeverRead peers(server->port(), count);
  EXPECT_TRUE(good(answer_to(server->port(), scene_request)));
  EXPECT_LT(resident() - before, 0.5 * count * page);
}

/// Without their leave: nothing of what they wait for has come when it has ended.
TEST_F(ViewPeersTest, EndsWhoeverIsConnected) {
  const PeersThatNeverRead unread(server->port(), 10);
  std::vector<int> silent, waiting;
  for (int i = 0; i < 10; ++i) silent.push_back(connected_to(server->port()));
  for (int i = 0; i < 10; ++i) {
    const std::string request = render_request(i, 1100 - i);
    waiting.push_back(connected_to(server->port()));
    ASSERT_GT(::send(waiting.back(), request.data(), request.size(), MSG_NOSIGNAL), 0);
  }
  EXPECT_TRUE(good(answer_to(server->port(), scene_request)));
  server->stop();
  EXPECT_EQ(connected_to(server->port()), -1);
  int rendered = 0;
  for (const int fd : waiting) rendered += has_answer(fd);
  EXPECT_LT(rendered, 10) << "it waited until all were rendered for";
  for (const auto* list : {&silent, &waiting})
    for (const int fd : *list) ::close(fd);
}

}  // namespace
}  // namespace orbitfuse::view
