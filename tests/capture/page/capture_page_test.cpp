// SPDX-License-Identifier: BSD-3-Clause
#include "capture/page/capture_page.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <thread>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"
#pragma GCC diagnostic ignored "-Wshadow"
#include <httplib.h>
#pragma GCC diagnostic pop

#include "core/image/image_codec.hpp"
#include "core/image/image_io.hpp"
#include "tests/support/slow_peers.hpp"

namespace orbitfuse {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

LiveState some_state() {
  LiveState state;
  state.session = "car \"A\"";
  state.running = true;
  state.elapsed_s = 83;
  state.free_bytes = 5ull << 30;
  StreamStatus stream;
  stream.device = "thermal0";
  stream.received = 90;
  stream.lost = 10;
  stream.missing = 7;
  stream.dropped = 3;
  stream.first_id = 1;
  stream.last_id = 100;
  state.streams = {stream};
  state.rates_hz = {29.9};
  LiveCamera camera;
  camera.instruction = "12° further left";
  camera.position = OrbitPosition{350, 12, 0.1, 0};
  state.cameras = {camera};
  OrbitPlan plan;
  state.sectors = Coverage(plan).sectors();
  state.sectors[0].best[Modality::visible].file = "visible/000000.jpg";
  state.warnings = warnings_of(state);
  return state;
}

class PageTest : public ::testing::Test {
 protected:
  void serve(PageOptions options) {
    options.port = 0;
    PageHooks hooks;
    hooks.state = some_state;
    hooks.latest = [this](Modality modality) {
      return modality == Modality::visible ? visible : thermal;
    };
    hooks.stop = [this]() -> Result<std::string> {
      ++stops;
      return "stopping";
    };
    hooks.correct = [this]() -> Result<std::string> {
      ++corrections;
      return fail(ErrorKind::unavailable, "thermal0", "the profile names no command", "set it");
    };
    server = std::make_unique<WebServer>(options, capture_page(hooks));
    const Status status = server->start();
    ASSERT_TRUE(status) << status.error().message();
  }
  httplib::Client client() const { return httplib::Client("127.0.0.1", server->port()); }

  std::optional<LatestFrame> visible, thermal;
  std::atomic<int> stops{0}, corrections{0};
  std::unique_ptr<WebServer> server;
};

TEST_F(PageTest, PageAsksNobodyElse) {
  serve({});
  const auto page = client().Get("/");
  ASSERT_TRUE(page);
  EXPECT_EQ(page->status, 200);
  for (const char* outside :
       {"http:", "https:", "//cdn", "src=\"//", "url(", "@import", "ws:", "<link"}) {
    EXPECT_THAT(page->body, Not(HasSubstr(outside)));
  }
  EXPECT_THAT(page->get_header_value("Content-Security-Policy"), HasSubstr("default-src 'none'"));
  EXPECT_THAT(page->get_header_value("Content-Security-Policy"), HasSubstr("connect-src 'self'"));
  EXPECT_EQ(server->url().find("token"), std::string::npos);
}

TEST_F(PageTest, EveryAddressOfAWildcardAnswers) {
  PageOptions options;
  options.host = "0.0.0.0";
  options.token = "right-token-1";
  options.require_token = true;
  serve(options);
  for (const std::string& url : server->urls()) {
    const std::size_t end = url.find('/', 7);
    httplib::Client browser(url.substr(0, end));
    const auto answer = browser.Get(url.substr(end));
    ASSERT_TRUE(answer) << url;
    EXPECT_EQ(answer->status, 200) << url;
  }
}

TEST_F(PageTest, StateIsWhatTheRecorderSays) {
  serve({});
  const auto answer = client().Get("/state");
  ASSERT_TRUE(answer);
  const auto state = nlohmann::json::parse(answer->body);
  EXPECT_EQ(state.at("session"), "car \"A\"");
  EXPECT_EQ(state.at("running"), true);
  const auto& stream = state.at("streams").at(0);
  EXPECT_EQ(stream.at("received").get<int>() + stream.at("lost").get<int>(), 100);
  EXPECT_EQ(stream.at("missing"), 7);
  EXPECT_EQ(stream.at("dropped"), 3);
  EXPECT_EQ(state.at("loops").size(), 3u);
  EXPECT_EQ(state.at("loops").at(0).at("sectors").size(), 12u);
  EXPECT_EQ(state.at("loops").at(0).at("sectors").at(0).at("visible"), true);
  EXPECT_EQ(state.at("loops").at(0).at("sectors").at(0).at("thermal"), false);
  EXPECT_EQ(state.at("cameras").at(0).at("instruction"), "12° further left");
  EXPECT_THAT(state.at("warnings").dump(), HasSubstr("3 frames dropped"));
}

TEST_F(PageTest, TokenIsAskedForEverything) {
  PageOptions options;
  options.token = "right-token-1";
  options.require_token = true;
  serve(options);
  const httplib::Headers wrong{{"X-Token", "wrong-token-1"}, {"X-OrbitFuse", "1"}},
      right{{"X-Token", "right-token-1"}, {"X-OrbitFuse", "1"}};
  for (const char* path :
       {"/", "/state", "/preview/visible", "/temperature?u=0&v=0", "/nonsense"}) {
    EXPECT_EQ(client().Get(path)->status, 401) << path;
    EXPECT_EQ(client().Get(path, wrong)->status, 401) << path;
    EXPECT_NE(client().Get(path, right)->status, 401) << path;
  }
  EXPECT_EQ(client().Post("/stop", wrong, "", "text/plain")->status, 401);
  EXPECT_EQ(stops, 0);
  EXPECT_EQ(client().Get("/?token=right-token-1")->status, 200);
  EXPECT_EQ(client().Get("/?token=right-token-")->status, 401);
  EXPECT_EQ(client().Get("/?token=")->status, 401);
  EXPECT_THAT(server->url(), HasSubstr("?token=right-token-1"));
  EXPECT_EQ(client().Post("/stop", right, "", "text/plain")->status, 200);
  EXPECT_EQ(stops, 1);
  EXPECT_EQ(client().Post("/nuc", wrong, "", "text/plain")->status, 401);
  EXPECT_EQ(client().Post("/nuc", right, "", "text/plain")->status, 409);
  EXPECT_EQ(corrections, 1);
}

TEST_F(PageTest, BeyondLoopbackATokenIsMade) {
  PageOptions options;
  options.host = "0.0.0.0";
  serve(options);
  EXPECT_EQ(server->token().size(), 32u);
  EXPECT_EQ(client().Get("/state")->status, 401);
  EXPECT_EQ(client().Get("/state", {{"X-Token", server->token()}})->status, 200);
}

TEST_F(PageTest, OtherSitesCannotPressItsButtons) {
  serve({});
  EXPECT_EQ(client().Post("/stop", httplib::Headers{}, "", "text/plain")->status, 403);
  EXPECT_EQ(client().Get("/stop")->status, 404);
  EXPECT_EQ(stops, 0);
  // A name of another site that was pointed at this machine.
  EXPECT_EQ(client().Get("/state", {{"Host", "evil.example:80"}})->status, 403);
  EXPECT_EQ(client().Get("/state", {{"Host", "localhost:80"}})->status, 200);
  EXPECT_EQ(client().Get("/state", {{"Host", "[::1]:80"}})->status, 200);
  EXPECT_EQ(client().Post("/start", {{"X-OrbitFuse", "1"}}, "", "text/plain")->status,
            404);  // no such hook
}

/// RFC 9110: a request without a length has no body, so that nothing more is to be waited for.
TEST_F(PageTest, PostWithoutALengthIsAnsweredAtOnce) {
  serve({});
  const auto post = [&](const char* method, const char* path, const char* header) {
    return test::answer_to(
        server->port(),
        std::string(method) + " " + path + " HTTP/1.1\r\nHost: 127.0.0.1\r\n" + header + "\r\n");
  };
  EXPECT_THAT(post("POST", "/stop", "X-OrbitFuse: 1\r\n"), HasSubstr(" 200 "));
  EXPECT_EQ(stops, 1);
  EXPECT_THAT(post("POST", "/nuc", "X-OrbitFuse: 1\r\nContent-Length: 0\r\n"), HasSubstr(" 409 "));
  EXPECT_EQ(corrections, 1);
  EXPECT_THAT(post("POST", "/nowhere", "X-OrbitFuse: 1\r\n"), HasSubstr(" 404 "));
  EXPECT_THAT(post("POST", "/stop", ""), HasSubstr(" 403 "));
  for (const char* method : {"PUT", "PATCH", "DELETE"})
    EXPECT_THAT(post(method, "/stop", "X-OrbitFuse: 1\r\n"), HasSubstr(" 405 "));
  EXPECT_EQ(stops, 1);
}

/// A button that does nothing says why.
TEST_F(PageTest, EveryButtonSaysWhatCameOfIt) {
  serve({});
  const httplib::Headers ours{{"X-OrbitFuse", "1"}};
  const auto stopped = client().Post("/stop", ours, "", "text/plain");
  EXPECT_EQ(nlohmann::json::parse(stopped->body),
            (nlohmann::json{{"done", true}, {"message", "stopping"}}));
  const auto refused = client().Post("/nuc", ours, "", "text/plain");
  const auto said = nlohmann::json::parse(refused->body);
  EXPECT_EQ(said.at("done"), false);
  EXPECT_THAT(said.at("message").get<std::string>(), HasSubstr("the profile names no command"));
}

TEST_F(PageTest, SlowPeersHoldUpNeitherViewersNorTheEnd) {
  using Clock = std::chrono::steady_clock;
  serve({});
  const test::SlowPeers peers(server->port(), 20);
  EXPECT_EQ(peers.count(), 20u);
  const auto asked = Clock::now();
  for (int i = 0; i < 10; ++i) {
    const auto answer = client().Get("/state");
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->status, 200);
  }
  EXPECT_LT(Clock::now() - asked, std::chrono::seconds(2));
  const auto ending = Clock::now();
  server->stop();
  EXPECT_LT(Clock::now() - ending, std::chrono::seconds(2));  // the bar; it took 38 s
}

TEST_F(PageTest, MorePeersThanThereIsRoomForDoNotShutAViewerOut) {
  serve({});
  const test::SlowPeers peers(server->port(), 200);
  for (int i = 0; i < 10; ++i) {
    const auto answer = client().Get("/state");
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->status, 200);
  }
}

TEST_F(PageTest, ARequestThatIsNotDoneInTimeIsCutOff) {
  serve({});
  const std::string begun = "GET /state HTTP/1.1\r\nHost: 127.0.0.1\r\n";
  EXPECT_EQ(test::answer_to(server->port(), begun, 20000), "");  // closed, not waited for
  EXPECT_THAT(test::answer_to(server->port(), begun + "X: " + std::string(20000, 'x')),
              HasSubstr(" 413 "));
  EXPECT_THAT(test::answer_to(server->port(), "nonsense\r\n\r\n"), HasSubstr(" 400 "));
}

TEST_F(PageTest, PreviewsAndTemperatures) {
  serve({});
  EXPECT_EQ(client().Get("/preview/visible")->status, 404);
  visible =
      LatestFrame{Modality::visible, cv::Mat(900, 1200, CV_8UC3, cv::Scalar(10, 200, 30)), "a"};
  const auto picture = client().Get("/preview/visible");
  ASSERT_EQ(picture->status, 200);
  EXPECT_EQ(picture->get_header_value("Content-Type"), "image/jpeg");
  const auto image = decode_image(picture->body, "preview");
  ASSERT_TRUE(image);
  EXPECT_EQ(image->cols, 640);
  EXPECT_NEAR(image->at<cv::Vec3b>(5, 5)[1], 200, 6);

  cv::Mat centikelvin(48, 64, CV_16UC1);
  for (int x = 0; x < 64; ++x) centikelvin.col(x) = 28000 + 100 * x;
  thermal = LatestFrame{Modality::thermal, centikelvin, "t"};
  const auto colours = client().Get("/preview/thermal?palette=white-hot&low=280&high=343");
  ASSERT_EQ(colours->status, 200);
  EXPECT_EQ(colours->get_header_value("X-Span-Low"), "280.00");
  const cv::Mat ramp = *decode_image(colours->body, "preview");
  EXPECT_LT(ramp.at<cv::Vec3b>(20, 1)[0], 30);
  EXPECT_GT(ramp.at<cv::Vec3b>(20, 62)[0], 225);
  const auto own_span = client().Get("/preview/thermal");
  EXPECT_NEAR(std::stod(own_span->get_header_value("X-Span-High")), 343, 2);
  EXPECT_NEAR(nlohmann::json::parse(client().Get("/temperature?u=0.5&v=0.5")->body)
                  .at("kelvin")
                  .get<double>(),
              312, 0.02);
  thermal = LatestFrame{
      Modality::thermal, cv::Mat(48, 64, CV_16UC1, cv::Scalar(29330)), "hot", {0.04, 0}};
  EXPECT_NEAR(nlohmann::json::parse(client().Get("/temperature?u=0.5&v=0.5")->body)
                  .at("kelvin")
                  .get<double>(),
              1173.2, 0.01);
  for (const char* bad : {"/temperature", "/temperature?u=2&v=0", "/temperature?u=nan&v=0",
                          "/temperature?u=x&v=0", "/preview/thermal?palette=mud"}) {
    EXPECT_EQ(client().Get(bad)->status, 400) << bad;
  }
  EXPECT_EQ(client().Get("/preview/../state")->status, 404);
}

TEST_F(PageTest, DeadPixelsOfAReducedPreviewAreNoTemperatures) {
  cv::Mat counts(960, 1280, CV_16UC1, cv::Scalar(30000));
  counts.col(1) = 0;  // reduced by half, its mean with column 0 would be 150 K
  thermal = LatestFrame{Modality::thermal, counts, "t"};
  serve({});
  const auto picture = client().Get("/preview/thermal?palette=white-hot&low=280&high=310");
  ASSERT_EQ(picture->status, 200);
  const cv::Mat shown = *decode_image(picture->body, "preview");
  ASSERT_EQ(shown.cols, 640);
  for (int x = 0; x < 8; ++x)
    EXPECT_NEAR(shown.at<cv::Vec3b>(20, x)[0], shown.at<cv::Vec3b>(20, 300)[0], 6) << x;
}

TEST_F(PageTest, TenViewersAreServed) {
  visible =
      LatestFrame{Modality::visible, cv::Mat(300, 400, CV_8UC3, cv::Scalar(10, 200, 30)), "a"};
  serve({});
  std::atomic<int> good{0};
  std::vector<std::jthread> viewers;
  for (int i = 0; i < 10; ++i) {
    viewers.emplace_back([&] {
      for (int n = 0; n < 5; ++n) {
        const auto a = client().Get("/state"), b = client().Get("/preview/visible");
        good += a && b && a->status == 200 && b->status == 200;
      }
    });
  }
  viewers.clear();
  EXPECT_EQ(good, 50);
}

TEST_F(PageTest, PortInUseAndBadOptionsHaveARemedy) {
  serve({});
  PageOptions options;
  options.port = server->port();
  WebServer second(options, capture_page({}));
  const Status taken = second.start();
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().kind, ErrorKind::device);
  EXPECT_THAT(taken.error().remedy, HasSubstr("--page"));
  options.port = 70000;
  EXPECT_EQ(options.validate().error().where, "page.port");
  options.port = 1;
  options.token = "short";
  EXPECT_EQ(options.validate().error().where, "page.token");
}

}  // namespace
}  // namespace orbitfuse
