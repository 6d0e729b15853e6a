// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/view_server.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstring>
#include <nlohmann/json.hpp>
#include <thread>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"
#pragma GCC diagnostic ignored "-Wshadow"
#include <httplib.h>
#pragma GCC diagnostic pop

#include "app/stages/rendered_views.hpp"
#include "app/view/layers.hpp"
#include "app/view/measuring.hpp"
#include "app/view/scene_json.hpp"
#include "app/view/shot_request.hpp"
#include "core/image/image_codec.hpp"
#include "core/image/image_io.hpp"
#include "fusion/heat/heat.hpp"
#include "tests/app/view/toy_run.hpp"
#include "tests/support/slow_peers.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::view {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

/// What the page reads out of several pictures in one answer.
struct Parts {
  json head;
  std::map<std::string, std::string> bytes;
  json of(const std::string& name) const {
    for (const json& part : head.at("parts"))
      if (part.at("name") == name) return part;
    return {};
  }
  double level(const std::string& name, int x, int y) const {
    const json part = of(name);
    std::uint16_t count = 0;
    std::memcpy(&count, bytes.at(name).data() + 2 * (y * part.at("width").get<int>() + x), 2);
    return count == 0 ? std::nan("")
                      : count * part.at("scale").get<double>() + part.at("offset").get<double>();
  }
};

Parts parts_of(const std::string& body) {
  Parts parts;
  std::uint32_t length = 0;
  std::memcpy(&length, body.data(), 4);
  parts.head = json::parse(body.substr(4, length));
  std::size_t at = 4 + length;
  for (const json& part : parts.head.at("parts")) {
    parts.bytes[part.at("name")] = body.substr(at, part.at("bytes"));
    at += part.at("bytes").get<std::size_t>();
  }
  EXPECT_EQ(at, body.size());
  return parts;
}

class ViewServerTest : public ::testing::Test {
 protected:
  void serve(PageOptions options = {}) {
    options.port = 0;
    FinishedRun run = test::toy_run(folder.path());
    views = run.views;
    for (const RecordedView& view : run.views)
      cameras.push_back(browser_camera(view.view.camera, view.view.cam_from_world));
    server = std::make_unique<ViewServer>(std::move(run), options);
    const Status status = server->start();
    ASSERT_TRUE(status) << status.error().message();
  }
  httplib::Client client() const {
    httplib::Client asking("127.0.0.1", server->port());
    asking.set_read_timeout(60);
    return asking;
  }
  httplib::Result render(const json& body) const { return post("/render", body.dump()); }
  httplib::Result post(const std::string& path, const std::string& body) const {
    return client().Post(path.c_str(), {{"X-OrbitFuse", "1"}}, body, "application/json");
  }
  /// As the page asks for the first recorded camera's place.
  json shot(int width, int height) const {
    json j = {{"client", "test"}, {"width", width}, {"height", height}};
    for (const char* key : {"position", "rotation_wxyz", "fov_deg"}) j[key] = cameras[0].at(key);
    return j;
  }

  orbitfuse::test::TempFolder folder;
  std::vector<RecordedView> views;
  std::vector<json> cameras;
  std::unique_ptr<ViewServer> server;
};

TEST_F(ViewServerTest, PageHasAllItNeedsAndAsksNobody) {
  serve();
  const auto page = client().Get("/");
  ASSERT_TRUE(page);
  ASSERT_EQ(page->status, 200);
  for (const char* outside :
       {" src=", "href=\"/", "href=\"h", "@import", "importScripts", "navigator.sendBeacon"})
    EXPECT_THAT(page->body, Not(HasSubstr(outside)));
  EXPECT_THAT(page->body, HasSubstr("THREE.OrbitControls"));
  EXPECT_THAT(page->body, Not(HasSubstr("/*STYLE*/")));
  const std::string policy = page->get_header_value("Content-Security-Policy");
  EXPECT_THAT(policy, HasSubstr("default-src 'none'"));
  EXPECT_THAT(policy, HasSubstr("connect-src 'self'"));
  EXPECT_THAT(policy, Not(HasSubstr("http")));
  EXPECT_EQ(server->urls().front().find("token"), std::string::npos);
}

TEST_F(ViewServerTest, SceneTellsWhatThereIs) {
  serve();
  const json scene = json::parse(client().Get("/scene")->body);
  EXPECT_EQ(scene.at("visible"), true);
  EXPECT_EQ(scene.at("thermal"), true);
  ASSERT_EQ(scene.at("views").size(), 12u);
  EXPECT_EQ(scene.at("views").at(1).at("doubt"), "a doubt");
  EXPECT_FALSE(scene.at("views").at(0).contains("doubt"));
  EXPECT_EQ(scene.at("palettes").at("inferno").get<std::string>().size(), 6u * 256);
  EXPECT_EQ(scene.at("span"), (json{290.0, 305.0}));
  const std::string surface = client().Get("/surface")->body;
  std::uint32_t count = 0;
  std::memcpy(&count, surface.data(), 4);
  EXPECT_EQ(count, 1000u);
  EXPECT_EQ(surface.size(), 28u + 1000 * 11);
}

TEST_F(ViewServerTest, SceneTellsTheScaleOfNow) {
  serve();
  const auto notes = [&] { return json::parse(client().Get("/scene")->body).at("notes").dump(); };
  EXPECT_THAT(notes(), HasSubstr("no scale in metres is known"));
  orbitfuse::test::put(folder / "scale.json", "{");
  EXPECT_THAT(notes(), HasSubstr("its scale can't be used"));
}

/// Its places would be others than those that the viewer shows.
TEST(Measuring, ARunThatWasMadeAgainIsRefused) {
  const orbitfuse::test::TempFolder folder;
  FinishedRun run;
  run.out = folder.path();
  run.session.emplace();
  run.identity = *identity_of_run(run.out);
  Measuring measuring(run);
  const auto same = measuring.list();
  ASSERT_FALSE(same);
  EXPECT_THAT(same.error().found, HasSubstr("no thermal frames"));
  run.identity = "of other fields";
  const auto again = measuring.list();
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().kind, ErrorKind::input);
  EXPECT_EQ(again.error().where, folder.path().string());
  EXPECT_THAT(again.error().found, HasSubstr("made again since the viewer was opened"));
  EXPECT_THAT(again.error().remedy, HasSubstr("open the viewer again"));
}

/// The page's camera and the recorded one are the same, and so are the temperatures that reach it
/// and the field's.
TEST_F(ViewServerTest, PicturesAreTheFieldsOwn) {
  serve();
  const FinishedRun run = test::toy_run(folder.path());  // trained alike: the same, bit for bit
  const auto answer = render(shot(64, 64));
  ASSERT_TRUE(answer);
  ASSERT_EQ(answer->status, 200) << answer->body;
  const Parts parts = parts_of(answer->body);
  const Camera camera = views[0].view.camera.scaled_to(64, 64);
  const auto truth = nerf::render(run.thermal, camera, views[0].view.cam_from_world,
                                  run.config.render.visible, {});
  ASSERT_TRUE(truth);
  int seen = 0;
  double off = 0;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      if (!(std::abs(truth->opacity.at<float>(y, x) - 0.5f) > 0.03f)) continue;
      const double level = parts.level("thermal", x, y);
      ASSERT_EQ(std::isnan(level), truth->opacity.at<float>(y, x) < 0.5f) << x << " " << y;
      if (std::isnan(level)) continue;
      ++seen;
      const double error = std::abs(level - static_cast<double>(truth->color.at<float>(y, x)));
      EXPECT_LT(error, 0.3);  // of 15 K; some pixels are their neighbours' mean
      off += error;
    }
  EXPECT_GT(seen, 500);
  EXPECT_LT(off / seen, 0.02);
  for (const char* layer : {"visible", "fused"}) {
    const auto image = decode_image(parts.bytes.at(layer), layer);
    ASSERT_TRUE(image);
    EXPECT_EQ(image->size(), cv::Size(64, 64));
    EXPECT_GT(cv::countNonZero(image->reshape(1) > 30), 1000);
  }
  json recorded = {{"client", "test"}, {"view", 0}, {"width", 64}};
  const Parts same = parts_of(render(recorded)->body);
  int alike = 0;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x)
      alike += std::abs(same.level("thermal", x, y) - parts.level("thermal", x, y)) < 0.02;
  EXPECT_GT(alike, 500);
}

/// The run's new views have it: the viewer's last pictures, films and radiometric images, too.
TEST_F(ViewServerTest, DetailOfRecordedFramesIsInTheLastPictures) {
  FinishedRun run = test::toy_run(folder.path());
  ASSERT_FALSE(run.has_detail());
  const auto brighter = [&](Modality modality, double by) {
    std::vector<nerf::DetailSource> sources;
    for (const nerf::TrainingView& view : nerf::test::toy_scene(modality, 6).views)
      sources.push_back(
          {{view.name, view.camera, view.cam_from_world},
           [image = cv::Mat(view.image + cv::Scalar::all(by))] { return Result<cv::Mat>(image); }});
    nerf::DetailOptions options;
    options.base_width_px = 32;
    options.depth_tolerance = 0.1;  // so small a field is a coarse one
    return nerf::PhotoDetail::of(std::move(sources), options).value();
  };
  run.visible_detail = brighter(Modality::visible, 0.05);
  run.thermal_detail = brighter(Modality::thermal, 1);
  EXPECT_TRUE(run.has_detail());
  EXPECT_EQ(scene_json(run).at("detail"), true);
  RenderTurns turns;
  LayerRenderer layers(run);
  RenderTurns::Job job(turns, "one", nullptr);
  const PosedView& view = run.views[0].view;
  const Shot shot{view.camera.scaled_to(64, 64), view.cam_from_world};
  const auto plain = layers.render(shot, {.every_pixel = true}, job),
             detailed = layers.render(shot, {.every_pixel = true, .detail = true}, job),
             after = layers.render(shot, {.every_pixel = true}, job);
  ASSERT_TRUE(plain && detailed && after);
  // As the render stage makes it.
  const auto own = [&](const nerf::Field& field, const nerf::PhotoDetail& lent) {
    nerf::PhotoDetail detail = lent;
    auto seen = nerf::render(field, shot.camera, shot.cam_from_world, run.config.render.visible, {})
                    .value();
    EXPECT_GT(detail.add(field, shot.camera, shot.cam_from_world, seen, {}).value(), 0.02);
    return seen;
  };
  const nerf::RenderedView colors = own(run.visible, run.visible_detail),
                           kelvin = own(run.thermal, run.thermal_detail);
  EXPECT_LE(cv::norm(detailed->visible, stages::bgr8_of_rgb(colors.color), cv::NORM_INF), 1);
  const cv::Mat known = detailed->kelvin == detailed->kelvin;
  EXPECT_LT(cv::norm(detailed->kelvin, kelvin.color, cv::NORM_INF, known), 0.01);
  EXPECT_GT(cv::norm(detailed->visible, plain->visible, cv::NORM_INF), 3);
  EXPECT_GT(cv::norm(detailed->kelvin, plain->kelvin, cv::NORM_INF, known), 0.3);
  EXPECT_EQ(cv::norm(after->visible, plain->visible, cv::NORM_INF), 0)
      << "it stays in what is kept";
}

/// The page's bar under the fused picture is made of these.
TEST_F(ViewServerTest, SceneTellsTheFusedPicturesOwnScale) {
  serve();
  const json heat = json::parse(client().Get("/scene")->body).at("heat");
  EXPECT_EQ(heat.at("usual"), 290);
  EXPECT_EQ(heat.at("hot"), 305);
  const cv::Mat colors = *fusion::heat_colors(stages::RunConfig().fuse.options.heat.palette);
  const std::string hex = heat.at("colors");
  ASSERT_EQ(hex.size(), 6u * 256);
  for (const int i : {0, 100, 255}) {
    const auto c = colors.at<cv::Vec3b>(0, i);
    EXPECT_EQ(hex.substr(6 * static_cast<std::size_t>(i), 6),
              fmt::format("{:02x}{:02x}{:02x}", c[2], c[1], c[0]));
  }
  // What is usual is not coloured, what is hot as strongly as in the picture.
  const std::string strengths = heat.at("strengths");
  ASSERT_EQ(strengths.size(), 2u * 256);
  EXPECT_EQ(strengths.substr(0, 2), "00");
  const double most = stages::RunConfig().fuse.options.heat.opacity;
  EXPECT_NEAR(std::stoi(strengths.substr(510), nullptr, 16), 255 * most, 2);
  // The bar begins, as the picture does, with what lies below.
  const std::string ramp = heat.at("ramp");
  ASSERT_EQ(ramp.size(), 6u * 256);
  EXPECT_EQ(ramp.substr(0, 2), ramp.substr(2, 2));
  EXPECT_EQ(ramp.substr(0, 2), ramp.substr(4, 2));
  EXPECT_NE(ramp.substr(6 * 255, 2), ramp.substr(6 * 255 + 4, 2));
}

TEST_F(ViewServerTest, AFolderWhoseNameIsNoUtf8IsShown) {
  PageOptions options;
  options.port = 0;
  server = std::make_unique<ViewServer>(test::toy_run(folder / "run\xff"), options);
  ASSERT_TRUE(server->start());
  const json scene = json::parse(client().Get("/scene")->body);
  EXPECT_THAT(scene.at("name").get<std::string>(), HasSubstr("/run"));
}

TEST_F(ViewServerTest, LayersAndSizesAreAsAsked) {
  serve();
  json asked = shot(48, 32);
  asked["layers"] = {"thermal", "fused"};
  asked["thermal_divisor"] = 2;
  const Parts parts = parts_of(render(asked)->body);
  EXPECT_EQ(parts.bytes.size(), 2u);
  EXPECT_EQ(parts.of("thermal").at("width"), 24);
  EXPECT_EQ(parts.of("fused").at("width"), 48);
}

TEST_F(ViewServerTest, HostileRequestsAreNamed) {
  serve();
  struct Case {
    const char* changed;
    const char* named;
  };
  const std::vector<Case> cases = {
      {R"({"position":[1,2]})", "position"},
      {R"({"position":[1,2,"x"]})", "position"},
      {R"({"position":[1,2,1e300]})", "position"},
      {R"({"position":null})", "position"},
      {R"({"rotation_wxyz":[0,0,0,0]})", "rotation_wxyz"},
      {R"({"rotation_wxyz":[9,0,0,0]})", "rotation_wxyz"},
      {R"({"fov_deg":0})", "fov_deg"},
      {R"({"fov_deg":180})", "fov_deg"},
      {R"({"fov_deg":"wide"})", "fov_deg"},
      {R"({"width":0})", "width"},
      {R"({"width":-5})", "width"},
      {R"({"width":1e9})", "width"},
      {R"({"width":8000,"height":8000})", "width, height"},
      {R"({"client":""})", "client"},
      {R"({"client":7})", "client"},
      {R"({"layers":"visible"})", "layers"},
      {R"({"layers":["mud"]})", "layers"},
      {R"({"thermal_divisor":0})", "thermal_divisor"},
      {R"({"detail":1})", "detail"},
      {R"({"view":-1})", "view"},
      {R"({"view":12})", "view"},
      {R"({"view":18446744073709551615})", "view"},
      {R"({"view":1.5})", "view"},
  };
  for (const Case& c : cases) {
    json body = shot(16, 16);
    body.update(json::parse(c.changed));
    const auto answer = render(body);
    ASSERT_TRUE(answer) << c.changed;
    EXPECT_EQ(answer->status, 400) << c.changed;
    EXPECT_THAT(answer->body, HasSubstr(c.named)) << c.changed;
  }
  const std::string deep = std::string(100000, '[') + std::string(100000, ']');
  for (const std::string& body :
       {std::string(), std::string("{"), std::string("[]"), std::string("nan"), deep,
        std::string("{\"position\":[NaN,0,0]}"), std::string("\xff\xfe{}", 4)})
    EXPECT_EQ(post("/render", body)->status, 400) << body.substr(0, 20);
  for (const char* path : {"/pick", "/measure", "/measurements/add", "/bookmarks/add",
                           "/bookmarks/remove", "/film", "/temperatures.tiff"})
    for (const std::string& body : {std::string(), std::string("{}"), std::string("[1]"), deep,
                                    std::string("{\"kind\":1,\"name\":[],\"u\":\"x\"}")})
      EXPECT_EQ(post(path, body)->status, 400) << path << " " << body.substr(0, 20);
  json outside = shot(64, 64);
  outside.update({{"u", 65}, {"v", 3}});
  EXPECT_EQ(post("/pick", outside.dump())->status, 400);
  EXPECT_EQ(post("/render", std::string(400'000, ' '))->status, 413);
  for (const char* path : {"/photo/99", "/photo/x", "/photo/../scene", "/nowhere", "/photo/0"})
    EXPECT_EQ(client().Get(path)->status, 404) << path;  // the toy has no session
  EXPECT_THAT(client().Get("/photo/0")->body, HasSubstr("session"));
}

TEST_F(ViewServerTest, TokenIsAskedForEverything) {
  PageOptions options;
  options.token = "right-token-1";
  options.require_token = true;
  serve(options);
  for (const char* path : {"/", "/scene", "/surface", "/photo/0", "/nonsense"}) {
    EXPECT_EQ(client().Get(path)->status, 401) << path;
    EXPECT_NE(client().Get(path, {{"X-Token", "right-token-1"}})->status, 401) << path;
  }
  EXPECT_EQ(render(shot(16, 16))->status, 401);
  EXPECT_EQ(client().Get("/?token=right-token-1")->status, 200);
  EXPECT_EQ(client().Get("/?token=right-token-2")->status, 401);
  EXPECT_EQ(
      client().Get("/scene", {{"Host", "evil.example"}, {"X-Token", "right-token-1"}})->status,
      403);
  EXPECT_EQ(client()
                .Post("/render", {{"X-Token", "right-token-1"}}, shot(16, 16).dump(), "text/plain")
                ->status,
            403);
}

TEST_F(ViewServerTest, TenViewersAndSlowPeersAreServedTogether) {
  serve();
  const orbitfuse::test::SlowPeers peers(server->port(), 20);
  ASSERT_EQ(peers.count(), 20u);
  std::atomic<int> good{0};
  {
    std::vector<std::jthread> viewers;
    for (int v = 0; v < 10; ++v)
      viewers.emplace_back([&, v] {
        for (int n = 0; n < 3; ++n) {
          json asked = shot(32 + v, 32);
          asked["client"] = "viewer " + std::to_string(v);
          const auto picture = render(asked);
          const auto scene = client().Get("/scene");
          good += picture && picture->status == 200 && scene && scene->status == 200;
        }
      });
  }
  EXPECT_EQ(good, 30);
}

TEST_F(ViewServerTest, TemperaturesAreTakenAwayAsSessionsHoldThem) {
  serve();
  const Parts parts = parts_of(render(shot(64, 48))->body);
  const auto tiff = post("/temperatures.tiff", shot(64, 48).dump());
  ASSERT_EQ(tiff->status, 200);
  orbitfuse::test::put(folder / "view.tiff", tiff->body);
  const auto kelvin = read_thermal_k(folder / "view.tiff");
  ASSERT_TRUE(kelvin) << kelvin.error().message();
  ASSERT_EQ(kelvin->size(), cv::Size(64, 48));
  int alike = 0;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x)
      alike += std::abs(static_cast<double>(kelvin->at<float>(y, x)) -
                        parts.level("thermal", x, y)) < 0.011;
  EXPECT_GT(alike, 500);
}

TEST_F(ViewServerTest, WhatIsKeptComesBackToEveryViewer) {
  serve();
  const json mark = {
      {"name", "a"}, {"position", {1, 0, 0}}, {"target", {0, 0, 0}}, {"fov_deg", 45}};
  EXPECT_EQ(post("/bookmarks/add", mark.dump())->status, 200);
  EXPECT_EQ(post("/bookmarks/add", mark.dump())->status, 400);  // the name is taken
  EXPECT_EQ(json::parse(client().Get("/bookmarks")->body).size(), 1u);
  EXPECT_EQ(post("/bookmarks/remove", R"({"name":"a"})")->status, 200);
  EXPECT_TRUE(json::parse(client().Get("/bookmarks")->body).empty());
  // The toy has no session to measure in.
  const auto refused = post("/measure", R"({"kind":"spot","places":[{"point":[0,0,0]}]})");
  EXPECT_EQ(refused->status, 404);
  EXPECT_THAT(refused->body, HasSubstr("session"));
}

/// Between two pieces a render learns that nobody waits for it: it is not gone on with.
TEST_F(ViewServerTest, WhatNobodyWaitsForIsNotRendered) {
  const FinishedRun run = test::toy_run(folder.path());
  RenderTurns turns;
  LayerRenderer layers(run);
  const PosedView& view = run.views[0].view;
  const Shot shot{view.camera.scaled_to(64, 64), view.cam_from_world};
  for (const bool closes : {false, true}) {
    std::atomic<bool> gone{false};
    RenderTurns::Job job(turns, "one", &gone);
    gone = !closes;
    if (closes) turns.close();
    const auto seen = layers.render(shot, {}, job);
    ASSERT_FALSE(seen);
    EXPECT_EQ(seen.error().kind, ErrorKind::cancelled);
  }
}

/// In the middle of renders, some of which nobody waits for.
TEST_F(ViewServerTest, EndsWhileViewersAreRenderedFor) {
  serve();
  std::vector<int> open;
  for (int i = 0; i < 12; ++i) {
    json asked = shot(1100, 1100);
    asked["client"] = "viewer " + std::to_string(i);
    asked["width"] = 1100 - i;
    const std::string body = asked.dump();
    const std::string request =
        "POST /render HTTP/1.1\r\nHost: 127.0.0.1\r\nX-OrbitFuse: 1\r\nContent-Length: " +
        std::to_string(body.size()) + "\r\n\r\n" + body;
    const int fd = orbitfuse::test::connected_to(server->port());
    ASSERT_GE(fd, 0);
    ASSERT_EQ(::send(fd, request.data(), request.size(), 0), static_cast<ssize_t>(request.size()));
    if (i < 4)
      ::close(fd);  // in the middle
    else
      open.push_back(fd);
  }
  EXPECT_EQ(client().Get("/scene")->status, 200);
  server->stop();
  EXPECT_FALSE(client().Get("/scene"));
  for (const int fd : open) ::close(fd);
}

TEST_F(ViewServerTest, PortInUseHasARemedy) {
  serve();
  PageOptions options;
  options.port = server->port();
  ViewServer second(test::toy_run(folder.path()), options);
  const Status taken = second.start();
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().kind, ErrorKind::device);
  EXPECT_THAT(taken.error().remedy, HasSubstr("--page"));
}

}  // namespace
}  // namespace orbitfuse::view
