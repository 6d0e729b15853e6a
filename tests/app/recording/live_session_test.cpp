// SPDX-License-Identifier: BSD-3-Clause
// Whole recordings with live parts: a GigE Vision camera on the loopback with viewers on its page,
// and a guided walk round a mat.
#include <gtest/gtest.h>

#include <cstdlib>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "app/recording/open_cameras.hpp"
#include "app/recording/recording.hpp"
#include "capture/mat/mat_finder.hpp"
#include "capture/page/capture_page.hpp"
#include "tests/support/gev_simulator.hpp"
#include "tests/support/rendered_mat.hpp"
#include "tests/support/temp_folder.hpp"

// Last: its <resolv.h> defines a macro _res that Eigen trips over.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"
#pragma GCC diagnostic ignored "-Wshadow"
#include <httplib.h>
#pragma GCC diagnostic pop

namespace orbitfuse::recording {
namespace {

using namespace std::chrono_literals;
using orbitfuse::testing::GevSimulator;

/// Seconds of the page test; ORBITFUSE_SOAK_S for another length.
double soak_s() {
  const char* wanted = std::getenv("ORBITFUSE_SOAK_S");
  return wanted ? std::atof(wanted) : 60.0;
}

TEST(LiveSession, TenViewersCostNoFrame) {
  GevSimulator camera;
  if (!camera.start_when_free()) GTEST_SKIP() << "the GVCP port 3956 on loopback is in use";
  Cameras cameras;
  ASSERT_TRUE(add_cameras(*parse_camera_spec("aravis:127.0.0.1"), Modality::thermal,
                          std::string(ORBITFUSE_SOURCE_DIR) + "/config/cameras", cameras));
  const test::TempFolder folder;
  RecordingOptions options;
  options.session = folder / "s";
  options.live = true;
  options.seconds = soak_s();
  options.guide = LiveGuideOptions{};
  Recording recording(std::move(cameras.sources), options);
  PageOptions page;
  page.port = 0;
  PageHooks hooks;
  hooks.state = [&] { return recording.state(); };
  hooks.latest = [&](Modality modality) { return recording.latest(modality); };
  WebServer server(page, capture_page(hooks));
  ASSERT_TRUE(server.start());
  ASSERT_TRUE(recording.prepare());
  std::atomic<bool> over{false};
  std::atomic<int> states{0}, previews{0};
  std::vector<std::jthread> viewers;
  for (int i = 0; i < 10; ++i) {
    viewers.emplace_back([&] {
      while (!over) {
        httplib::Client client("127.0.0.1", server.port());
        const auto state = client.Get("/state"), picture = client.Get("/preview/thermal");
        states += state && state->status == 200;
        previews += picture && picture->status == 200;
        std::this_thread::sleep_for(400ms);
      }
    });
  }
  const auto ending = recording.run(nullptr);
  over = true;
  viewers.clear();
  ASSERT_TRUE(ending) << ending.error().message();
  const StreamStatus stream = recording.status().at(0);
  std::printf(
      "%.0f s: %llu received, %llu missing, %llu rejected, %llu dropped; %d states and %d previews "
      "served\n",
      options.seconds, static_cast<unsigned long long>(stream.received),
      static_cast<unsigned long long>(stream.missing),
      static_cast<unsigned long long>(stream.rejected),
      static_cast<unsigned long long>(stream.dropped), states.load(), previews.load());
  EXPECT_EQ(stream.lost, 0u);
  EXPECT_GT(static_cast<double>(stream.received), 25 * options.seconds);
  EXPECT_GT(previews, 10);
  const auto session = open_session(folder / "s");
  ASSERT_TRUE(session);
  EXPECT_TRUE(session->complete);
  EXPECT_EQ(session->frames.size(), stream.received);
}

/// A visible camera that is carried round a mat: rests at stations, moves on, stops at the end.
class WalkingCamera final : public FrameSource {
 public:
  DeviceInfo describe() const override {
    DeviceInfo device;
    device.id = "visible0";
    device.driver = "walk";
    return device;
  }
  Status start() override { return {}; }
  Result<Delivery> next(std::chrono::milliseconds) override {
    Delivery delivery;
    if (id_ >= 12 * 8) {
      delivery.kind = Delivery::Kind::end;
      return delivery;
    }
    std::this_thread::sleep_for(60ms);
    const auto station = static_cast<double>(id_ / 8), phase = static_cast<double>(id_ % 8);
    const double azimuth = 30 * station + (phase < 5 ? 0 : 8 * (phase - 4));
    const cv::Mat view =
        test::view_of_mat(mat_, design_.size_m, camera_, test::orbit_pose(azimuth, 30, 1.0));
    delivery.kind = Delivery::Kind::frame;
    delivery.frame.id = id_++;
    delivery.frame.host_time_ns = static_cast<std::int64_t>(1.7e18) +
                                  static_cast<std::int64_t>(delivery.frame.id) * 250'000'000;
    cv::cvtColor(view, delivery.frame.pixels, cv::COLOR_GRAY2BGR);
    return delivery;
  }
  void stop() override {}

 private:
  MatDesign design_;
  Camera camera_ = Camera::from_fov(480, 360, 50);
  cv::Mat mat_ = test::printed_mat(black_rectangles(design_), design_.size_m, 0.0005);
  std::uint64_t id_ = 0;
};

TEST(LiveSession, GuidedWalkLeavesItsStationsInTheSession) {
  const test::TempFolder folder;
  RecordingOptions options;
  options.session = folder / "s";
  options.choose_stations = true;
  options.guide = LiveGuideOptions{};
  options.guide->plan.loop_elevations_deg = {30};
  options.guide->plan.modalities = {Modality::visible};
  options.guide->looks_per_second = 50;
  std::vector<std::unique_ptr<FrameSource>> sources;
  sources.push_back(std::make_unique<WalkingCamera>());
  const auto mat = std::make_shared<MatFinder>(MatDesign{});
  Recording recording(
      std::move(sources), options,
      [mat](const cv::Mat& image, Modality modality) -> std::optional<OrbitPosition> {
        const auto sighting = mat->find(image, modality);
        if (!sighting) return std::nullopt;
        return sighting->position;
      });
  ASSERT_TRUE(recording.prepare());
  const auto ending = recording.run(nullptr);
  ASSERT_TRUE(ending) << ending.error().message();
  EXPECT_EQ(recording.guide()->done_count(Modality::visible), 12);
  const auto session = open_session(folder / "s");
  ASSERT_TRUE(session) << session.error().message();
  const auto stations = session->frames_of(Modality::visible, false);
  ASSERT_EQ(stations.size(), 12u);
  for (const FrameRecord* frame : stations) {
    ASSERT_TRUE(frame->station);
    const double truth = 30.0 * static_cast<double>(frame->sequence / 8);
    EXPECT_LT(frame->sequence % 8, 5u) << "chosen while walking";
    EXPECT_LE(std::abs(angle_difference_deg(frame->station->azimuth_deg, truth)), 1);
  }
  EXPECT_EQ(session->frames.size(), 96u);
}

}  // namespace
}  // namespace orbitfuse::recording
