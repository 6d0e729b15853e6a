// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "app/export/viewer_surface.hpp"
#include "app/view/view_server.hpp"
#include "tests/app/cli/program.hpp"
#include "tests/app/cli/session_fixture.hpp"
#include "tests/support/browser.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::view {
namespace fs = std::filesystem;

/// Pixels of a part of the picture that are not of its most frequent colour: something is drawn.
inline double lit_share(const cv::Mat& image, const cv::Rect& part) {
  std::map<std::tuple<int, int, int>, int> counts;
  const cv::Mat inside = image(part & cv::Rect({}, image.size()));
  for (int y = 0; y < inside.rows; ++y)
    for (int x = 0; x < inside.cols; ++x) {
      const auto p = inside.at<cv::Vec3b>(y, x);
      ++counts[{p[0] / 8, p[1] / 8, p[2] / 8}];
    }
  int most = 0;
  for (const auto& [color, count] : counts) most = std::max(most, count);
  return 1 - static_cast<double>(most) / static_cast<double>(inside.total());
}

inline double difference(const cv::Mat& a, const cv::Mat& b, const cv::Rect& part) {
  return cv::norm(a(part), b(part), cv::NORM_L1) / static_cast<double>(part.area());
}

class ViewBrowserTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!orbitfuse::test::Browser::is_here()) GTEST_SKIP() << "chromium is not installed";
    // ORBITFUSE_VIEW_RUN: another finished run to look at, e.g. of a container.
    if (const char* given = std::getenv("ORBITFUSE_VIEW_RUN")) {
      out = folder.path() / "copy";
      fs::copy(given, out, fs::copy_options::recursive);
      fs::remove(out / "measurements.json");
      fs::remove(out / "bookmarks.json");
    } else {
      fs::copy(made_once(), out, fs::copy_options::recursive);
    }
    serve(exporting::viewer_surface);
  }

  void serve(const MeshMaker& make_mesh) {
    auto run = load_finished_run(out, stages::RunConfig(), {});
    ASSERT_TRUE(run) << run.error().message();
    PageOptions options;
    options.port = 0;
    options.token = "browser-token";
    options.require_token = true;
    server = std::make_unique<ViewServer>(*std::move(run), options, make_mesh);
    ASSERT_TRUE(server->start());
    url = server->urls().front();
  }

  static fs::path made_once() {
    static const orbitfuse::test::TempFolder made;
    if (!fs::exists(made / "out" / "report")) make_run(made.path());
    return made / "out";
  }

  static void make_run(const fs::path& in) {
    const fs::path session = in / "session";
    write_fixture_session(session);
    std::vector<std::string> words = {"run", session.string(), "--out", (in / "out").string()};
    for (const char* set :
         {"train.visible.iterations=400", "train.thermal.iterations=400",
          "train.visible.eval_count=0", "train.thermal.eval_count=0",
          "train.visible.cloud_width_px=96", "train.thermal.cloud_width_px=96",
          "train.visible.cloud_tolerance=0.2", "train.thermal.cloud_tolerance=0.2",
          "render.views=2", "render.width_px=64"})
      words.insert(words.end(), {"--set", set});
    const Outcome made = orbitfuse_program(words);
    ASSERT_EQ(made.code, 0) << made.err;
  }

  /// For a person to look at, where ORBITFUSE_SHOTS names a folder.
  static cv::Mat kept(const std::string& name, const cv::Mat& shot) {
    if (const char* to = std::getenv("ORBITFUSE_SHOTS"))
      cv::imwrite((fs::path(to) / (name + ".png")).string(), shot);
    return shot;
  }

  static bool rests(orbitfuse::test::Browser& page) {
    return page.becomes("viewer.rest.finished && viewer.rest.level >= 2");
  }
  static void choose(orbitfuse::test::Browser& page, const std::string& layer) {
    page.evaluate("document.querySelector('[data-value=" + layer + "]').click()");
    EXPECT_TRUE(rests(page));
  }

  orbitfuse::test::TempFolder folder;
  fs::path out = folder.path() / "out";
  std::unique_ptr<ViewServer> server;
  std::string url;
};

}  // namespace orbitfuse::view
