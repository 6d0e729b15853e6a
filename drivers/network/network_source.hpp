// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/clock/clock_map.hpp"
#include "capture/frame_source.hpp"
#include "capture/recording/frame_rhythm.hpp"
#include "capture/recording/lasting_failure.hpp"
#include "drivers/network/video_feed.hpp"

namespace orbitfuse::network {

struct NetworkOptions {
  FeedOptions feed;                    ///< its url: http, https (MJPEG) or rtsp, rtsps
  std::string device_id = "visible0";  ///< key in the session

  Status validate() const;
};

/// The URL without what is nobody's business: user, password and query.
std::string public_url(const std::string& url);

/// A phone or network camera: MJPEG over HTTP, whose JPEGs are kept as they were sent, or a video
/// over RTSP, whose pictures become JPEGs. Such streams number nothing, so ids count what arrives;
/// an outage costs the frames that fit into its time, and a pause is told ("late-frame"). A
/// connection that ends or falls silent is opened again for as long as the recording lasts; the
/// camera is back with its first frame, and only with the size that it had.
class NetworkSource final : public FrameSource {
 public:
  explicit NetworkSource(NetworkOptions options);
  ~NetworkSource() override;

  DeviceInfo describe() const override;
  Status start() override;
  Result<Delivery> next(std::chrono::milliseconds timeout) override;
  void stop() override;
  std::vector<Delivery> unfinished() override;

 private:
  using Clock = std::chrono::steady_clock;
  std::optional<Delivery> refused(const std::string& why);
  Delivery lose(EventKind kind, const std::string& why);
  std::optional<Delivery> delivery_of(FeedItem item);
  std::optional<Delivery> of_another_size(const FeedItem& item, cv::Size size);
  Delivery frame_of(FeedItem item);

  NetworkOptions options_;
  std::unique_ptr<VideoFeed> feed_;
  cv::Size size_;  ///< of the first frame, and so of all; empty before it
  bool away_ = false, refused_size_ = false;  ///< the latter until the connection ends
  std::uint64_t next_id_ = 0;
  std::vector<Delivery> pending_;
  FrameRhythm rhythm_;
  ClockMap clock_;
  LastingFailure failure_;
  Clock::time_point last_frame_{}, last_late_event_{};
  std::uint64_t late_frames_ = 0;
};

}  // namespace orbitfuse::network
