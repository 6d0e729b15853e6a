// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <string>
#include <thread>
#include <utility>

#include "capture/frame_source.hpp"

namespace orbitfuse::test {

inline Delivery frame_delivery(std::uint64_t id, const cv::Mat& pixels) {
  Delivery d;
  d.kind = Delivery::Kind::frame;
  d.frame.id = id;
  d.frame.host_time_ns = static_cast<std::int64_t>(1000 * (id + 1));
  d.frame.pixels = pixels;
  return d;
}

inline Delivery rejected_delivery(std::uint64_t id, const std::string& reason) {
  Delivery d;
  d.kind = Delivery::Kind::rejected;
  d.frame.id = id;
  d.reason = reason;
  return d;
}

inline cv::Mat thermal_pixels(int width = 32, int height = 24) {
  cv::Mat image(height, width, CV_16UC1);
  for (int i = 0; i < width * height; ++i) {
    image.at<std::uint16_t>(i / width, i % width) =
        static_cast<std::uint16_t>(29000 + (i * 37) % 900);
  }
  return image;
}

/// A camera that plays a script.
class ScriptedSource : public FrameSource {
 public:
  ScriptedSource(std::string id, Modality modality, std::deque<Delivery> script)
      : script_(std::move(script)) {
    device_.id = std::move(id);
    device_.modality = modality;
    device_.driver = "script";
  }
  DeviceInfo describe() const override { return device_; }
  Status start() override {
    if (fail_start) return fail(ErrorKind::device, device_.id, "no such camera", "plug it in");
    return {};
  }
  Result<Delivery> next(std::chrono::milliseconds) override {
    if (script_.empty()) {
      if (fail_at_end) return fail(ErrorKind::device, device_.id, "unplugged", "plug it in again");
      Delivery end;
      end.kind = Delivery::Kind::end;
      return end;
    }
    if (before_next) before_next();
    if (pause.count() > 0) std::this_thread::sleep_for(pause);
    Delivery d = std::move(script_.front());
    script_.pop_front();
    return d;
  }
  void stop() override {
    ++stops;
    if (at_stop) at_stop();
  }
  bool can_wait() const override { return waits; }

  bool fail_start = false, fail_at_end = false, waits = false;
  std::function<void()> before_next, at_stop;
  std::chrono::milliseconds pause{0};
  int stops = 0;

 private:
  DeviceInfo device_;
  std::deque<Delivery> script_;
};

}  // namespace orbitfuse::test
