// SPDX-License-Identifier: BSD-3-Clause
// The page in a real browser without a screen; pixels are looked at.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <opencv2/core.hpp>

#include "capture/page/capture_page.hpp"
#include "core/image/image_io.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

bool has_chromium() { return std::system("command -v chromium > /dev/null 2>&1") == 0; }

struct Shown {
  int green = 0, magenta = 0, red = 0;
};

/// A screenshot after two seconds of page time, and how many pixels have the colours of done
/// sectors, of the picture and of the alarm.
Shown screenshot(const std::string& url, const std::string& size,
                 const std::filesystem::path& folder) {
  const auto file = folder / "shot.png";
  std::filesystem::remove(file);
  const std::string command =
      "timeout 60 chromium --headless --no-sandbox --disable-gpu --disable-dev-shm-usage "
      "--no-first-run "
      "--disable-background-networking --host-resolver-rules='MAP * ~NOTFOUND, EXCLUDE 127.0.0.1' "
      "--user-data-dir='" +
      (folder / "profile").string() + "' --hide-scrollbars --window-size=" + size +
      " --virtual-time-budget=3000 --screenshot='" + file.string() + "' '" + url +
      "' > /dev/null 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0);
  Shown shown;
  const auto image = read_visible(file);
  EXPECT_TRUE(image) << (image ? "" : image.error().message());
  if (!image) return shown;
  for (int y = 0; y < image->rows; ++y) {
    for (int x = 0; x < image->cols; ++x) {
      const cv::Vec3b p = image->at<cv::Vec3b>(y, x);
      shown.green += cv::norm(cv::Vec3i(p[0] - 0x4c, p[1] - 0xc2, p[2] - 0x27)) < 12;
      shown.red += cv::norm(cv::Vec3i(p[0] - 0x1e, p[1] - 0x26, p[2] - 0xb3)) < 12;
      shown.magenta += p[0] > 220 && p[1] < 40 && p[2] > 220;
    }
  }
  return shown;
}

class BrowserTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!has_chromium()) GTEST_SKIP() << "chromium is not installed";
    PageOptions options;
    options.port = 0;
    options.token = "browser-token";
    options.require_token = true;
    PageHooks hooks;
    hooks.state = [this] {
      LiveState state;
      state.session = "browser";
      state.running = true;
      state.sectors = Coverage(OrbitPlan{}).sectors();
      state.cameras.resize(2);
      state.cameras[1].modality = Modality::thermal;
      StreamStatus stream;
      stream.device = "thermal0";
      stream.modality = Modality::thermal;
      if (away) stream.away = Absence{8.2, "no frame for a second"};
      state.streams = {stream};
      for (int i = 0; i < done; ++i)
        state.sectors[static_cast<std::size_t>(i)].best = {{Modality::visible, {"v", 1}},
                                                           {Modality::thermal, {"t", 1}}};
      return state;
    };
    hooks.latest = [this](Modality modality) {
      const cv::Mat magenta(300, 400, CV_8UC3, cv::Scalar(255, 0, 255));
      return modality == Modality::visible
                 ? std::optional(LatestFrame{Modality::visible, magenta, "a"})
                 : std::nullopt;
    };
    server = std::make_unique<WebServer>(options, capture_page(hooks));
    ASSERT_TRUE(server->start());
  }

  test::TempFolder folder;
  std::atomic<int> done{0};
  std::atomic<bool> away{false};
  std::unique_ptr<WebServer> server;
};

TEST_F(BrowserTest, SectorsTurnGreenAndThePictureShows) {
  const Shown none = screenshot(server->url(), "900,900", folder.path());
  EXPECT_EQ(none.green, 0);
  EXPECT_GT(none.magenta, 10000);
  done = 18;
  const Shown half = screenshot(server->url(), "900,900", folder.path());
  done = 36;
  const Shown all = screenshot(server->url(), "900,900", folder.path());
  EXPECT_GT(half.green, 5000);
  EXPECT_GT(all.green, half.green * 3 / 2);
}

TEST_F(BrowserTest, FitsAPhone) {
  done = 36;
  const Shown phone = screenshot(server->url(), "400,1800", folder.path());
  EXPECT_GT(phone.green, 3000);
  EXPECT_GT(phone.magenta, 10000);
}

TEST_F(BrowserTest, ACameraThatIsAwayIsARedBanner) {
  const Shown there = screenshot(server->url(), "900,900", folder.path());
  away = true;
  const Shown gone = screenshot(server->url(), "900,900", folder.path());
  EXPECT_GT(gone.red, there.red + 5000);
}

TEST_F(BrowserTest, WithoutTokenNothingIsShown) {
  done = 36;
  const std::string url = server->url();
  const Shown refused = screenshot(url.substr(0, url.find('?')), "900,900", folder.path());
  EXPECT_EQ(refused.green + refused.magenta, 0);
}

}  // namespace
}  // namespace orbitfuse
