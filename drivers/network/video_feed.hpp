// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

namespace orbitfuse::network {

struct FeedOptions {
  std::string url;
  std::chrono::milliseconds open{4000};  ///< to connect the first time, and to tell what will come
  /// Silence after which the connection is given up, and the time to connect again: what the end of
  /// a recording waits for at most.
  std::chrono::milliseconds stall{1500};
  std::chrono::milliseconds reopen_every{500};  ///< while the camera is away
  /// Of frames that wait to be taken: some ten pictures of 4K, decoded. A bigger frame is refused.
  std::size_t max_queued_bytes = std::size_t{256} << 20;
};

/// What a connection brought.
struct FeedItem {
  enum class Kind { opened, frame, closed, silent, refused } kind = Kind::frame;
  std::chrono::steady_clock::time_point at{};
  std::int64_t utc_ns = 0;  ///< when it was read
  int skipped = 0;          ///< frames before this one that nobody took in time
  std::string jpeg;         ///< a frame as the camera sent it
  cv::Mat image;            ///< or decoded from a video stream, CV_8UC3
  cv::Size size;            ///< of an opened stream
  std::string why;          ///< closed, silent (and closed for that) or refused

  std::size_t bytes() const { return jpeg.size() + image.total() * image.elemSize(); }
};

/// Reads a stream from the network on a thread of its own, through OpenCV over FFmpeg: its calls
/// wait for the network and can't be interrupted, so nobody else waits for them. When the feed goes
/// while a call hangs (a name server that does not answer), the thread is left behind and ends with
/// that call.
class VideoFeed {
 public:
  explicit VideoFeed(FeedOptions options);
  ~VideoFeed();
  VideoFeed(const VideoFeed&) = delete;
  VideoFeed& operator=(const VideoFeed&) = delete;

  /// The next item; nothing within the time given, and nothing more after what close() left.
  std::optional<FeedItem> take(std::chrono::milliseconds timeout);
  /// Ends the connection that is, if any; it is opened again as after any end.
  void reopen();
  /// Nothing more comes in; what waits can still be taken. Returns how many frames nobody took in
  /// time after the last of them.
  int close();

  struct Shared;

 private:
  std::shared_ptr<Shared> shared_;
};

}  // namespace orbitfuse::network
