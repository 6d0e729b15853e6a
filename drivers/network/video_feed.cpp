// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/network/video_feed.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <exception>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <thread>
#include <utility>
#include <vector>

#include "core/system/utc_now.hpp"

namespace orbitfuse::network {

struct VideoFeed::Shared {
  FeedOptions options;
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<FeedItem> items;
  bool over = false, ended = false, reopen = false;
  int skipped = 0;
  std::size_t queued_bytes = 0;

  /// Frames that nobody takes are counted, not hoarded.
  void put(FeedItem item) {
    constexpr std::size_t most = 32;
    item.at = std::chrono::steady_clock::now();
    item.utc_ns = utc_now_ns();
    const std::size_t bytes = item.bytes();
    const std::lock_guard lock(mutex);
    if (over) return;
    if (item.kind == FeedItem::Kind::frame) {
      if (items.size() >= most || queued_bytes + bytes > options.max_queued_bytes) {
        ++skipped;
        return;
      }
      item.skipped = std::exchange(skipped, 0);
    }
    queued_bytes += bytes;
    items.push_back(std::move(item));
    changed.notify_all();
  }
  /// False when the feed goes.
  bool pause() {
    std::unique_lock lock(mutex);
    return !changed.wait_for(lock, options.reopen_every, [&] { return over; });
  }
  bool is_over() {
    const std::lock_guard lock(mutex);
    return over;
  }
  bool must_end() {
    const std::lock_guard lock(mutex);
    return over || std::exchange(reopen, false);
  }
};

namespace {

using Shared = VideoFeed::Shared;

void put(Shared& shared, FeedItem::Kind kind, std::string why, cv::Size size = {}) {
  FeedItem item;
  item.kind = kind;
  item.why = std::move(why);
  item.size = size;
  shared.put(std::move(item));
}

bool open(cv::VideoCapture& capture, const FeedOptions& options, bool first) {
  const auto deadline = first ? options.open : std::min(options.open, options.stall);
  try {
    return capture.open(options.url, cv::CAP_FFMPEG,
                        {cv::CAP_PROP_OPEN_TIMEOUT_MSEC, static_cast<int>(deadline.count()),
                         cv::CAP_PROP_READ_TIMEOUT_MSEC, static_cast<int>(options.stall.count())});
  } catch (const cv::Exception&) {
    return false;
  }
}

/// FFmpeg calls them "MJPG", "mjpe" and more.
bool holds_jpegs(const cv::VideoCapture& capture) {
  const auto code = static_cast<std::uint32_t>(capture.get(cv::CAP_PROP_FOURCC));
  std::string name;
  for (int i = 0; i < 4; ++i) {
    const auto letter = static_cast<unsigned char>(code >> (8 * i));
    name += static_cast<char>(std::tolower(letter));
  }
  return name.starts_with("mjp") || name == "jpeg";
}

/// Until the connection ends; returns what is to be told of that.
FeedItem read_all(Shared& shared, cv::VideoCapture& capture) {
  // Photos of a stream of JPEGs are kept as they were sent.
  const bool jpegs = holds_jpegs(capture) && capture.set(cv::CAP_PROP_FORMAT, -1);
  FeedItem ending;
  ending.kind = FeedItem::Kind::closed;
  ending.why = "the stream ended or broke";
  while (!shared.must_end()) {
    const auto asked = std::chrono::steady_clock::now();
    FeedItem item;
    if (!capture.read(item.image) || item.image.empty()) {
      if (std::chrono::steady_clock::now() - asked < shared.options.stall) return ending;
      ending.kind = FeedItem::Kind::silent;
      ending.why = "no frame came";
      return ending;
    }
    if (item.bytes() > shared.options.max_queued_bytes) {
      ending.why = fmt::format("a frame of {} bytes came", item.bytes());
      return ending;
    }
    if (jpegs) {
      item.jpeg.assign(reinterpret_cast<const char*>(item.image.data),
                       item.image.total() * item.image.elemSize());
      item.image.release();
    } else if (item.image.channels() == 1) {
      cv::cvtColor(item.image, item.image, cv::COLOR_GRAY2BGR);
    }
    shared.put(std::move(item));
  }
  return ending;
}

void read_connection(Shared& shared, bool first) {
  cv::VideoCapture capture;
  if (!open(capture, shared.options, first))
    return put(shared, FeedItem::Kind::refused, "no video can be had from it");
  // OpenCV before 4.7 turns by it the wrong way round, and the JPEGs of a stream not at all.
  if (const int turned = cvRound(capture.get(cv::CAP_PROP_ORIENTATION_META)); turned != 0) {
    return put(shared, FeedItem::Kind::refused,
               fmt::format("a video that is to be turned by {} degrees: send it upright", turned));
  }
  const cv::Size size(static_cast<int>(capture.get(cv::CAP_PROP_FRAME_WIDTH)),
                      static_cast<int>(capture.get(cv::CAP_PROP_FRAME_HEIGHT)));
  shared.must_end();  // what was asked of the connection before is done
  put(shared, FeedItem::Kind::opened, {}, size);
  shared.put(read_all(shared, capture));
}

void run(const std::shared_ptr<Shared>& shared) {
  bool first = true;
  while (!shared->is_over()) {
    // A thread has nobody to throw to: memory that ran out ends the connection, not the recording.
    try {
      read_connection(*shared, std::exchange(first, false));
    } catch (const std::exception& error) {
      put(*shared, FeedItem::Kind::closed, error.what());
    }
    if (!shared->pause()) break;
  }
  const std::lock_guard lock(shared->mutex);
  shared->ended = true;
  shared->changed.notify_all();
}

}  // namespace

VideoFeed::VideoFeed(FeedOptions options) : shared_(std::make_shared<Shared>()) {
  shared_->options = std::move(options);
  std::thread(run, shared_).detach();
}

VideoFeed::~VideoFeed() {
  std::unique_lock lock(shared_->mutex);
  shared_->over = true;
  shared_->changed.notify_all();
  shared_->changed.wait_for(lock, shared_->options.stall + std::chrono::milliseconds(200),
                            [&] { return shared_->ended; });
}

void VideoFeed::reopen() {
  const std::lock_guard lock(shared_->mutex);
  shared_->reopen = true;
}

int VideoFeed::close() {
  const std::lock_guard lock(shared_->mutex);
  shared_->over = true;
  shared_->changed.notify_all();
  return std::exchange(shared_->skipped, 0);
}

std::optional<FeedItem> VideoFeed::take(std::chrono::milliseconds timeout) {
  std::unique_lock lock(shared_->mutex);
  std::deque<FeedItem>& items = shared_->items;
  shared_->changed.wait_for(lock, timeout, [&] { return !items.empty() || shared_->over; });
  if (items.empty()) return std::nullopt;
  FeedItem item = std::move(items.front());
  items.pop_front();
  shared_->queued_bytes -= item.bytes();
  return item;
}

}  // namespace orbitfuse::network
