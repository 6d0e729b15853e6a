// SPDX-License-Identifier: BSD-3-Clause
// What every page of the program stands on; tests/capture/page tests more of it by the capture
// page.
#include "core/http/web_server.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/socket.h>
#include <unistd.h>

#include <thread>
#include <vector>

#include "core/http/reachable.hpp"
#include "tests/support/slow_peers.hpp"

namespace orbitfuse {
namespace {

using ::testing::HasSubstr;

TEST(ReachableHosts, WildcardsBecomeAddressesToType) {
  EXPECT_EQ(reachable_hosts("192.168.7.9"), std::vector<std::string>{"192.168.7.9"});
  const std::vector<std::string> v4 = reachable_hosts("0.0.0.0"), v6 = reachable_hosts("::");
  EXPECT_EQ(v4.back(), "127.0.0.1");
  EXPECT_EQ(v6.back(), "::1");
  for (const std::string& host : v4) {
    EXPECT_NE(host, "0.0.0.0");
    EXPECT_EQ(host.find(':'), std::string::npos);
  }
  for (const std::string& host : v6) EXPECT_FALSE(host.starts_with("fe80:")) << host;
}

TEST(RequestSize, IsHeadAndBody) {
  EXPECT_EQ(request_size("GET / HTTP/1.1\r\nHost: x\r\n"), std::nullopt);
  EXPECT_EQ(request_size("GET / HTTP/1.1\r\n\r\n"), 18u);
  EXPECT_EQ(request_size("POST / HTTP/1.1\r\ncontent-LENGTH: 7\r\n\r\nabc"), 38u + 7u);
  EXPECT_GT(request_size("POST / HTTP/1.1\r\nContent-Length: 99999999999999999999\r\n\r\n"),
            1u << 29);
}

TEST(PageAddress, IsPortOrHostAndPort) {
  EXPECT_EQ(page_options_of("--port", "8471", "")->host, "127.0.0.1");
  EXPECT_EQ(page_options_of("--port", "[::1]:0", "")->host, "::1");
  const auto open = page_options_of("--port", "0.0.0.0:8471", "long-enough");
  EXPECT_EQ(open->port, 8471);
  EXPECT_TRUE(open->require_token);
  for (const char* bad : {"", ":80", "x", "80x", "1.2.3.4:", "1.2.3.4:-1", "99999"})
    EXPECT_FALSE(page_options_of("--port", bad, "")) << bad;
}

class WebServerTest : public ::testing::Test {
 protected:
  void serve(WebHandler handler, const GateLimits& limits = {}) {
    WebSite site;
    site.limits = limits;
    site.get = {{"/wait", std::move(handler)}};
    site.post = {{"/echo", [](const WebRequest& request) {
                    return text_answer(200, request.body + request.parameter("a"));
                  }}};
    PageOptions options;
    options.port = 0;
    server = std::make_unique<WebServer>(options, site);
    ASSERT_TRUE(server->start());
  }
  std::string ask(const std::string& request) const {
    return test::answer_to(server->port(), request);
  }
  std::unique_ptr<WebServer> server;
};

TEST_F(WebServerTest, BodiesAndParametersArrive) {
  serve([](const WebRequest&) { return text_answer(200, ""); });
  const std::string head = "POST /echo?a=b%20c HTTP/1.1\r\nHost: 127.0.0.1\r\nX-OrbitFuse: 1\r\n";
  EXPECT_THAT(ask(head + "Content-Length: 3\r\n\r\nxyz"), HasSubstr("\r\n\r\nxyzb c\n"));
  EXPECT_THAT(ask(head + "\r\n"), HasSubstr("\r\n\r\nb c\n"));
}

/// An answer that flows is not cut off by the clock: here after a tenth of a second.
TEST_F(WebServerTest, ALargeAnswerArrivesOverASlowNetwork) {
  const std::string body(32u << 20, 'x');
  GateLimits limits;
  limits.answer = std::chrono::milliseconds(100);
  limits.least_bytes_per_s = 1;
  serve([&](const WebRequest&) { return text_answer(200, body); }, limits);
  const int fd = test::connected_to(server->port());
  const std::string request = "GET /wait HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n";
  ASSERT_EQ(::send(fd, request.data(), request.size(), 0), static_cast<ssize_t>(request.size()));
  std::vector<char> bytes(1 << 20);
  std::size_t got = 0;
  for (ssize_t count = 1; count > 0;) {
    if (got < 2'000'000) std::this_thread::sleep_for(std::chrono::milliseconds(200));
    count = ::recv(fd, bytes.data(), got < 2'000'000 ? 500'000 : bytes.size(), 0);
    if (count > 0) got += static_cast<std::size_t>(count);
  }
  ::close(fd);
  EXPECT_GT(got, body.size());
}

/// Long work ends when nobody waits for it: the peer left, or the server stops.
TEST_F(WebServerTest, AHandlerLearnsThatItsPeerLeft) {
  std::atomic<int> begun{0}, told{0};
  serve([&](const WebRequest& request) {
    ++begun;
    for (int i = 0; i < 1000 && !*request.gone; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    told += *request.gone ? 1 : 0;
    return text_answer(200, "");
  });
  const std::string request = "GET /wait HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n";
  const auto wait_for = [](const std::atomic<int>& count, int wanted) {
    for (int i = 0; i < 500 && count < wanted; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return count.load();
  };
  const int first = test::connected_to(server->port());
  ASSERT_EQ(::send(first, request.data(), request.size(), 0), static_cast<ssize_t>(request.size()));
  ASSERT_EQ(wait_for(begun, 1), 1);
  ::close(first);
  EXPECT_EQ(wait_for(told, 1), 1);
  const int second = test::connected_to(server->port());
  ASSERT_EQ(::send(second, request.data(), request.size(), 0),
            static_cast<ssize_t>(request.size()));
  ASSERT_EQ(wait_for(begun, 2), 2);
  server->stop();
  EXPECT_EQ(told, 2);
  ::close(second);
}

}  // namespace
}  // namespace orbitfuse
