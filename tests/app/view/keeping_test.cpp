// SPDX-License-Identifier: BSD-3-Clause
// What a viewer keeps in the run's folder, and the way of its camera along kept views.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <thread>

#include "app/view/bookmarks.hpp"
#include "app/view/film.hpp"
#include "core/image/image_io.hpp"
#include "tests/app/view/toy_run.hpp"
#include "tests/support/file_size_limit.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::view {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;

Bookmark at(const std::string& name, double x, double y, double z) {
  return {name, {x, y, z}, {0, 0, 0}, 45};
}

TEST(Bookmarks, ComeBackAsTheyWereKept) {
  const orbitfuse::test::TempFolder folder;
  Bookmarks first(folder.path());
  EXPECT_TRUE(first.list()->empty());
  ASSERT_TRUE(first.add(at("façade \"A\"", 1, 2, 3)));
  // Another viewer of the same run.
  Bookmarks second(folder.path());
  ASSERT_TRUE(second.add(at("b", 3, 2, 1)));
  const auto list = *first.list();
  ASSERT_EQ(list.size(), 2u);
  EXPECT_EQ(list[0].name, "façade \"A\"");
  EXPECT_EQ(list[0].position, Eigen::Vector3d(1, 2, 3));
  EXPECT_FALSE(first.add(at("b", 1, 1, 1)));
  EXPECT_FALSE(first.remove("c"));
  ASSERT_TRUE(first.remove("b"));
  EXPECT_EQ(second.list()->size(), 1u);
}

/// Each viewer of a run has its own Bookmarks: the folder's lock keeps them apart.
TEST(Bookmarks, OfViewersAtOnceAreAllKept) {
  const orbitfuse::test::TempFolder folder;
  std::atomic<int> failed{0};
  {
    std::vector<std::jthread> viewers;
    for (int v = 0; v < 4; ++v)
      viewers.emplace_back([&, v] {
        Bookmarks own(folder.path());
        for (int i = 0; i < 15; ++i)
          failed += !own.add(at(std::to_string(v) + " " + std::to_string(i), 1, 2, 3));
      });
  }
  EXPECT_EQ(failed, 0);
  EXPECT_EQ(Bookmarks(folder.path()).list()->size(), 60u);
}

TEST(Bookmarks, ADamagedFileIsNamedAndLeftAsItIs) {
  const orbitfuse::test::TempFolder folder;
  Bookmarks bookmarks(folder.path());
  for (const char* text :
       {"", "{", "[]", "{\"schema\":1}", "{\"schema\":9,\"bookmarks\":[]}",
        "{\"schema\":1,\"bookmarks\":[{\"name\":\"a\"}]}",
        "{\"schema\":1,\"bookmarks\":[{\"name\":\"a\",\"position\":[1,2,null],\"target\":[0,0,0],"
        "\"fov_deg\":45}]}"}) {
    orbitfuse::test::put(folder / "bookmarks.json", text);
    const auto list = bookmarks.list();
    ASSERT_FALSE(list) << text;
    EXPECT_THAT(list.error().where, HasSubstr("bookmarks.json"));
    EXPECT_FALSE(bookmarks.add(at("b", 1, 1, 1)));
    EXPECT_EQ(orbitfuse::test::get(folder / "bookmarks.json"), text);
  }
}

TEST(Bookmarks, WhatIsNoViewIsNamed) {
  const json good = to_json(at("a", 1, 2, 3));
  ASSERT_TRUE(bookmark_of(good));
  for (const auto& [field, value] :
       std::vector<std::pair<std::string, json>>{{"name", ""},
                                                 {"name", std::string(81, 'x')},
                                                 {"name", 1},
                                                 {"position", json::array({1, 2})},
                                                 {"position", json::array({1, 2, 1e9})},
                                                 {"target", json::array({1, 2, 3})},
                                                 {"fov_deg", 0},
                                                 {"fov_deg", "wide"}}) {
    json wrong = good;
    wrong[field] = value;
    const auto refused = bookmark_of(wrong);
    ASSERT_FALSE(refused) << wrong;
    EXPECT_EQ(refused.error().where, field);
  }
}

TEST(Way, GoesRoundAndNotThrough) {
  const auto way = way_along({at("a", 2, 0, 0), at("b", 0, 2, 0), at("c", 0, 0, 8)}, 10);
  ASSERT_EQ(way.size(), 21u);
  EXPECT_TRUE(way.front().position.isApprox(Eigen::Vector3d(2, 0, 0)));
  EXPECT_TRUE(way[10].position.isApprox(Eigen::Vector3d(0, 2, 0)));
  EXPECT_TRUE(way.back().position.isApprox(Eigen::Vector3d(0, 0, 8)));
  for (int i = 0; i <= 10; ++i)
    EXPECT_NEAR(way[static_cast<std::size_t>(i)].position.norm(), 2, 1e-9);
  for (std::size_t i = 11; i < way.size(); ++i)
    EXPECT_GE(way[i].position.norm(), way[i - 1].position.norm());
  // From one side to the other: any way round, at its distance.
  for (const Bookmark& b : way_along({at("a", 2, 0, 0), at("b", -2, 0, 0)}, 8)) {
    EXPECT_TRUE(b.position.allFinite());
    EXPECT_NEAR(b.position.norm(), 2, 1e-9);
  }
}

TEST(Way, CamerasLookAtTheirTargetsAndStandUpright) {
  for (const Bookmark& b : {at("a", 2, 0, 0), at("b", 1, 1, 1), at("top", 0, 0, 3)}) {
    const Shot shot = shot_of_bookmark(b, Eigen::Vector3d::UnitZ(), 64, 48);
    ASSERT_TRUE(shot.cam_from_world.is_finite());
    const Eigen::Vector2d middle = shot.camera.project(shot.cam_from_world * b.target);
    EXPECT_TRUE(middle.isApprox(Eigen::Vector2d(32, 24), 1e-9)) << middle.transpose();
    const Eigen::Vector3d up = shot.cam_from_world.rotation * Eigen::Vector3d::UnitZ();
    EXPECT_LE(up.y(), 1e-9);  // y is down
    EXPECT_NEAR(up.x(), 0, 1e-9);
  }
}

class FilmTest : public ::testing::Test {
 protected:
  json finished() {
    for (int i = 0; i < 3000 && films.state().at("making") == true; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    return films.state();
  }
  orbitfuse::test::TempFolder folder;
  FinishedRun run = test::toy_run(folder.path());
  RenderTurns turns;
  LayerRenderer layers{run};
  FilmMaker films{run, layers, turns};
  const std::vector<Bookmark> views{at("a", 1, 0, 0.2), at("b", 0, 1, 0.2)};
  FilmOrder order{FilmKind::pictures, FilmLayer::thermal, "inferno", {290, 305}, 0.5, 6, 64, 64};
};

TEST_F(FilmTest, PicturesAreNumberedAndComplete) {
  ASSERT_TRUE(films.begin(order, views));
  const json state = finished();
  ASSERT_TRUE(state.contains("file")) << state;
  EXPECT_EQ(state.at("done"), 4);
  for (int i = 0; i < 4; ++i) {
    const auto image = read_image(folder / "films/001" / ("0000" + std::to_string(i) + ".png"));
    ASSERT_TRUE(image);
    EXPECT_EQ(image->size(), cv::Size(64, 64));
  }
  ASSERT_TRUE(films.begin(order, views));
  EXPECT_THAT(finished().at("file").get<std::string>(), HasSubstr("002"));
}

/// Black would be the palette's coldest colour.
TEST_F(FilmTest, WhatIsNotMeasuredIsHatched) {
  run.config.render.min_opacity = 2;  // nothing is
  ASSERT_TRUE(films.begin(order, views));
  ASSERT_TRUE(finished().contains("file"));
  const auto image = read_image(folder / "films/001/00000.png");
  ASSERT_TRUE(image);
  const int plain = cv::countNonZero(image->reshape(1) == 128),
            stripes = cv::countNonZero(image->reshape(1) == 96);
  EXPECT_GT(plain, stripes);
  EXPECT_GT(stripes, 0);
  EXPECT_EQ(plain + stripes, 3 * 64 * 64);
}

TEST_F(FilmTest, Mp4IsAFilm) {
  order.kind = FilmKind::mp4;
  order.layer = FilmLayer::fused;
  ASSERT_TRUE(films.begin(order, views));
  const json state = finished();
  if (state.contains("error")) {
    EXPECT_THAT(state.at("error").get<std::string>(), HasSubstr("no H.264 encoder here"));
    GTEST_SKIP() << state.at("error");
  }
  const std::string bytes = orbitfuse::test::get(folder / "films/001.mp4");
  EXPECT_EQ(bytes.substr(4, 4), "ftyp");
  EXPECT_GT(bytes.size(), 500u);
}

/// As on a full disk: no file may grow beyond some bytes.
TEST_F(FilmTest, Mp4ThatCannotBeWrittenIsNotMade) {
  order.kind = FilmKind::mp4;
  Status begun;
  json state;
  {
    const orbitfuse::test::FileSizeLimit full(200);
    begun = films.begin(order, views);
    state = finished();
  }
  ASSERT_TRUE(begun);
  EXPECT_FALSE(state.contains("file")) << state;
  EXPECT_TRUE(state.contains("error")) << state;
  EXPECT_TRUE(fs::is_empty(folder / "films"));
}

/// Who is refused a turn while too many wait asks again; nobody's name ends the film's jobs.
TEST_F(FilmTest, IsMadeAlthoughTooManyViewersWait) {
  std::optional<RenderTurns::Turn> held;
  RenderTurns::Job holder(turns, "film", nullptr);
  held.emplace(std::move(*holder.turn(1)));
  std::atomic<int> refused{0}, served{0};
  std::vector<std::jthread> viewers;
  for (int v = 0; v < 17; ++v)
    viewers.emplace_back([&, v] {
      RenderTurns::Job job(turns, std::to_string(v), nullptr);
      ++(job.turn(1) ? served : refused);
    });
  while (refused == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  // 16 wait now.
  ASSERT_TRUE(films.begin(order, views));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  const json waiting = films.state();
  EXPECT_EQ(waiting.at("making"), true) << waiting;
  held.reset();
  while (films.state().at("making") == true) const RenderTurns::Job page(turns, "film", nullptr);
  const json state = finished();
  EXPECT_TRUE(state.contains("file")) << state;
}

TEST_F(FilmTest, ThatThrowsIsAnErrorAndNoEnd) {
  run.thermal = {};  // of which film_order_of would not let an order be made
  ASSERT_TRUE(films.begin(order, views));
  EXPECT_TRUE(finished().contains("error"));
}

/// A stop that comes while a film begins ends it, or comes before it: it never waits for the whole
/// of one.
TEST_F(FilmTest, StopsAndBeginsMayMeet) {
  order.seconds_a_view = 60;
  order.fps = 60;
  for (int i = 0; i < 50; ++i) {
    std::jthread begins([&] { (void)films.begin(order, views); });
    films.stop();
    begins.join();
    films.stop();
    EXPECT_EQ(films.state().at("making"), false);
  }
}

TEST_F(FilmTest, StoppedLeavesNothing) {
  order.seconds_a_view = 60;
  order.fps = 60;
  ASSERT_TRUE(films.begin(order, views));
  EXPECT_FALSE(films.begin(order, views));  // one at a time
  films.stop();
  EXPECT_EQ(films.state().at("error"), "stopped");
  EXPECT_TRUE(!fs::exists(folder / "films") || fs::is_empty(folder / "films"));
}

TEST_F(FilmTest, OrdersThatCannotBeMadeAreNamed) {
  EXPECT_FALSE(films.begin(order, {views[0]}));
  EXPECT_FALSE(films.begin(order, {}));
  const json good = {{"kind", "png"},      {"layer", "thermal"}, {"palette", "inferno"},
                     {"span", {290, 305}}, {"width", 64},        {"height", 64}};
  ASSERT_TRUE(film_order_of(good, run));
  for (const auto& [field, value] :
       std::vector<std::pair<std::string, json>>{{"kind", "gif"},
                                                 {"layer", "mud"},
                                                 {"palette", "mud"},
                                                 {"span", json::array({300})},
                                                 {"span", {300, 290}},
                                                 {"width", 1e9},
                                                 {"height", -1},
                                                 {"fps", 0},
                                                 {"seconds_a_view", 0},
                                                 {"width", nullptr}}) {
    json wrong = good;
    wrong[field] = value;
    EXPECT_FALSE(film_order_of(wrong, run)) << wrong;
  }
}

}  // namespace
}  // namespace orbitfuse::view
