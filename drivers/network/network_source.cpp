// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/network/network_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "core/image/image_codec.hpp"
#include "core/image/jpeg_size.hpp"
#include "core/option_range.hpp"

namespace orbitfuse::network {
namespace {

/// Of pictures of a video stream: lossless files of these would be ten times as large.
constexpr int jpeg_quality = 95;

double seconds(std::chrono::steady_clock::duration time) {
  return std::chrono::duration<double>(time).count();
}

std::int64_t count_ns(std::chrono::steady_clock::time_point time) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count();
}

}  // namespace

std::string public_url(const std::string& url) {
  const std::size_t scheme = url.find("://");
  if (scheme == std::string::npos) return {};
  const std::size_t begin = scheme + 3;
  const std::size_t path = std::min(url.find_first_of("/?#", begin), url.size());
  const std::size_t user = url.rfind('@', path);
  const std::size_t host = user != std::string::npos && user >= begin ? user + 1 : begin;
  const std::size_t end = std::min(url.find_first_of("?#", path), url.size());
  return url.substr(0, begin) + url.substr(host, end - host);
}

Status NetworkOptions::validate() const {
  constexpr std::array<std::string_view, 4> schemes{"http://", "https://", "rtsp://", "rtsps://"};
  const std::string& url = feed.url;
  const bool known = std::any_of(schemes.begin(), schemes.end(), [&](std::string_view scheme) {
    return url.starts_with(scheme) && url.size() > scheme.size();
  });
  const bool printable =
      std::all_of(url.begin(), url.end(), [](unsigned char c) { return c > 0x20 && c != 0x7f; });
  if (!known || !printable || url.size() > 2000) {
    return fail(ErrorKind::usage, "network.url", "not an address of a stream",
                "write network:http://ADDRESS:PORT/PATH (MJPEG) or network:rtsp://ADDRESS/PATH");
  }
  const OptionCheck check("network");
  ORBITFUSE_TRY(check("open", seconds(feed.open), above(0)));
  ORBITFUSE_TRY(check("stall", seconds(feed.stall), above(0)));
  return check("reopen_every", seconds(feed.reopen_every), above(0));
}

NetworkSource::NetworkSource(NetworkOptions options) : options_(std::move(options)) {}

NetworkSource::~NetworkSource() { stop(); }

DeviceInfo NetworkSource::describe() const {
  DeviceInfo info;
  info.id = options_.device_id;
  info.modality = Modality::visible;
  info.driver = "network";
  info.model = "network camera";
  info.serial = public_url(options_.feed.url);
  return info;
}

Status NetworkSource::start() {
  ORBITFUSE_TRY(options_.validate());
  feed_ = std::make_unique<VideoFeed>(options_.feed);
  const std::string where = public_url(options_.feed.url);
  const char* remedy = "is the phone's app running, and both in one network? Open it in a browser";
  // A name that is looked up in vain has no deadline of its own.
  const auto first = feed_->take(options_.feed.open + std::chrono::seconds(1));
  std::string found;
  if (!first) {
    found = fmt::format("no answer within {:.0f} s", seconds(options_.feed.open) + 1);
  } else if (first->kind != FeedItem::Kind::opened) {
    found = first->why;
  } else if (first->size.empty() ||
             3LL * first->size.width * first->size.height > max_image_samples) {
    found = fmt::format("a video of {}x{}", first->size.width, first->size.height);
  }
  if (!found.empty()) {
    stop();
    return fail(ErrorKind::device, where, found, remedy);
  }
  away_ = false;
  last_frame_ = Clock::now();
  return {};
}

void NetworkSource::stop() { feed_.reset(); }

Delivery NetworkSource::lose(EventKind kind, const std::string& why) {
  away_ = true;
  rhythm_.interrupt();
  return event_delivery(kind, why + "; opening it again");
}

std::optional<Delivery> NetworkSource::refused(const std::string& why) {
  if (!failure_.note(why)) return std::nullopt;
  return event_delivery(EventKind::reopen_failed, why);
}

/// A camera that was set anew or turned. It may be set back, which only a new connection tells of
/// every kind of stream; what came meanwhile is part of the outage.
std::optional<Delivery> NetworkSource::of_another_size(const FeedItem& item, cv::Size size) {
  refused_size_ = true;
  feed_->reopen();
  const std::string why =
      fmt::format("a picture of {}x{}, the session's are {}x{}: set it as before", size.width,
                  size.height, size_.width, size_.height);
  if (away_) return refused(why);
  Delivery delivery;
  delivery.kind = Delivery::Kind::rejected;
  next_id_ += static_cast<std::uint64_t>(item.skipped);
  delivery.frame.id = next_id_++;
  delivery.reason = why;
  last_frame_ = item.at;
  pending_.push_back(lose(EventKind::disconnected, why));
  return delivery;
}

Delivery NetworkSource::frame_of(FeedItem item) {
  Delivery delivery;
  delivery.kind = Delivery::Kind::frame;
  Frame& frame = delivery.frame;
  if (away_) {
    const double outage_s = seconds(item.at - last_frame_);
    // What nobody took in time before it lies in the same time.
    const std::uint64_t cost = std::max(rhythm_.known() ? rhythm_.frames_in(outage_s) - 1 : 0,
                                        static_cast<std::uint64_t>(item.skipped));
    next_id_ += cost;
    away_ = false;
    failure_.clear();
    Delivery event =
        event_delivery(EventKind::reconnected,
                       fmt::format("after {:.1f} s, about {} frames lost", outage_s, cost));
    last_frame_ = item.at;
    item.skipped = 0;
    pending_.push_back(frame_of(std::move(item)));
    return event;
  }
  // What nobody took in time is lost between two ids.
  next_id_ += static_cast<std::uint64_t>(item.skipped);
  frame.id = next_id_++;
  last_frame_ = item.at;
  frame.host_time_ns = clock_.add({}, item.utc_ns).host_time_ns;
  frame.extension = ".jpg";
  if (item.jpeg.empty()) {
    Result<std::string> encoded = encode_jpeg(item.image, jpeg_quality);
    if (!encoded) {
      delivery.kind = Delivery::Kind::rejected;
      delivery.reason = encoded.error().found;
      return delivery;
    }
    item.jpeg = std::move(*encoded);
  }
  const int missing = rhythm_.note(frame.id, count_ns(item.at));
  late_frames_ += static_cast<std::uint64_t>(missing);
  if (missing > 0 && Clock::now() - last_late_event_ > std::chrono::seconds(10)) {
    last_late_event_ = Clock::now();
    pending_.push_back(event_delivery(
        EventKind::late_frame,
        fmt::format("frame {} is late by {}; {} so far: the network holds frames up or the camera "
                    "leaves some out, and nothing tells which",
                    frame.id, missing, late_frames_)));
  }
  const std::string_view bytes = item.jpeg;
  const bool whole = bytes.starts_with("\xff\xd8") && jpeg_size(bytes) &&
                     bytes.substr(0, bytes.find_last_not_of('\0') + 1).ends_with("\xff\xd9");
  if (!whole) {
    delivery.kind = Delivery::Kind::rejected;
    delivery.reason = "no whole JPEG";
    return delivery;
  }
  frame.encoded = std::move(item.jpeg);
  return delivery;
}

std::optional<Delivery> NetworkSource::delivery_of(FeedItem item) {
  switch (item.kind) {
    case FeedItem::Kind::opened:
      refused_size_ = false;
      break;
    case FeedItem::Kind::refused:
      return refused(item.why);
    case FeedItem::Kind::closed:
      if (!away_) return lose(EventKind::disconnected, item.why);
      break;
    case FeedItem::Kind::silent:
      if (!away_) return lose(EventKind::stalled, item.why);
      break;
    case FeedItem::Kind::frame: {
      if (refused_size_) break;
      const std::optional<cv::Size> size =
          item.jpeg.empty() ? item.image.size() : jpeg_size(item.jpeg);
      if (size && size_.empty()) size_ = *size;
      if (size && *size != size_) return of_another_size(item, *size);
      return frame_of(std::move(item));
    }
  }
  return std::nullopt;
}

Result<Delivery> NetworkSource::next(std::chrono::milliseconds timeout) {
  if (!pending_.empty()) {
    Delivery delivery = std::move(pending_.front());
    pending_.erase(pending_.begin());
    return delivery;
  }
  if (!feed_)
    return fail(ErrorKind::device, public_url(options_.feed.url), "not started",
                "call start() first");
  std::optional<FeedItem> item = feed_->take(timeout);
  if (!item) return Delivery{};
  return delivery_of(std::move(*item)).value_or(Delivery{});
}

std::vector<Delivery> NetworkSource::unfinished() {
  std::vector<Delivery> list = std::exchange(pending_, {});
  if (!feed_) return list;
  const int skipped = feed_->close();
  while (std::optional<FeedItem> item = feed_->take(std::chrono::milliseconds(0))) {
    if (std::optional<Delivery> delivery = delivery_of(std::move(*item)))
      list.push_back(std::move(*delivery));
    std::move(pending_.begin(), pending_.end(), std::back_inserter(list));
    pending_.clear();
  }
  const double quiet_s = seconds(Clock::now() - last_frame_);
  const bool gone = away_ || quiet_s > seconds(options_.feed.stall) / 2;
  const std::uint64_t by_time = gone && rhythm_.known() ? rhythm_.frames_in(quiet_s) : 0;
  const std::uint64_t missing = std::max(by_time, static_cast<std::uint64_t>(skipped));
  if (missing == 0) return list;
  Delivery lost;
  lost.kind = Delivery::Kind::lost;
  lost.frame.id = next_id_ + missing - 1;
  lost.reason =
      missing > by_time
          ? fmt::format("{} frames at the end that came faster than they were stored", skipped)
          : fmt::format("no frame for the last {:.1f} s, counted by time", quiet_s);
  list.push_back(std::move(lost));
  return list;
}

}  // namespace orbitfuse::network
