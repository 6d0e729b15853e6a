// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/network/network_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "core/image/image_codec.hpp"

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
  for (const auto& [field, time] :
       {std::pair{"open", feed.open}, {"stall", feed.stall}, {"reopen_every", feed.reopen_every}}) {
    if (time.count() <= 0)
      return fail(ErrorKind::usage, std::string("network.") + field,
                  fmt::format("{} ms", time.count()), "must be > 0");
  }
  return {};
}

NetworkSource::NetworkSource(NetworkOptions options) : options_(std::move(options)) {
  set_up_ffmpeg();
}

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
  size_ = first->size;
  away_ = false;
  last_frame_ = Clock::now();
  return {};
}

void NetworkSource::stop() { feed_.reset(); }

Delivery NetworkSource::lose(const std::string& why) {
  away_ = true;
  rhythm_.interrupt();
  return event_delivery(why == "no frame came" ? EventKind::stalled : EventKind::disconnected,
                        why + "; opening it again");
}

std::optional<Delivery> NetworkSource::refused(const std::string& why) {
  if (!failure_.note(why)) return std::nullopt;
  return event_delivery(EventKind::reopen_failed, why);
}

std::optional<Delivery> NetworkSource::opened(const FeedItem& item) {
  refused_size_ = item.size != size_;
  if (!refused_size_) return std::nullopt;
  return refused(fmt::format("came back with {}x{}, the session's is {}x{}: set it as before",
                             item.size.width, item.size.height, size_.width, size_.height));
}

Delivery NetworkSource::frame_of(FeedItem item) {
  // What nobody took in time is lost between two ids.
  next_id_ += static_cast<std::uint64_t>(item.skipped);
  Delivery delivery;
  delivery.kind = Delivery::Kind::frame;
  Frame& frame = delivery.frame;
  if (away_) {
    const double outage_s = seconds(item.at - last_frame_);
    const std::uint64_t cost = rhythm_.known() ? rhythm_.frames_in(outage_s) - 1 : 0;
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
  frame.id = next_id_++;
  last_frame_ = item.at;
  frame.host_time_ns = clock_.add(0, item.utc_ns).host_time_ns;
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
  const bool whole = bytes.size() > 4 && bytes.starts_with("\xff\xd8") &&
                     bytes.substr(0, bytes.find_last_not_of('\0') + 1).ends_with("\xff\xd9");
  if (!whole) {
    delivery.kind = Delivery::Kind::rejected;
    delivery.reason = "no whole JPEG";
    return delivery;
  }
  frame.encoded = std::move(item.jpeg);
  return delivery;
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
  std::optional<Delivery> delivery;
  switch (item->kind) {
    case FeedItem::Kind::opened:
      delivery = opened(*item);
      break;
    case FeedItem::Kind::refused:
      delivery = refused(item->why);
      break;
    case FeedItem::Kind::closed:
      if (!away_) delivery = lose(item->why);
      break;
    case FeedItem::Kind::frame:
      if (!refused_size_) delivery = frame_of(std::move(*item));
      break;
  }
  return delivery ? std::move(*delivery) : Delivery{};
}

std::vector<Delivery> NetworkSource::unfinished() {
  std::vector<Delivery> list = std::exchange(pending_, {});
  while (feed_) {
    std::optional<FeedItem> item = feed_->take(std::chrono::milliseconds(0));
    if (!item) break;
    if (item->kind == FeedItem::Kind::frame && !refused_size_)
      list.push_back(frame_of(std::move(*item)));
    if (item->kind == FeedItem::Kind::closed && !away_) list.push_back(lose(item->why));
    std::move(pending_.begin(), pending_.end(), std::back_inserter(list));
    pending_.clear();
  }
  const double quiet_s = seconds(Clock::now() - last_frame_);
  const bool gone = away_ || quiet_s > seconds(options_.feed.stall) / 2;
  if (!gone || !rhythm_.known()) return list;
  Delivery lost;
  lost.kind = Delivery::Kind::lost;
  lost.frame.id = next_id_ + rhythm_.frames_in(quiet_s) - 1;
  lost.reason = fmt::format("no frame for the last {:.1f} s, counted by time", quiet_s);
  list.push_back(std::move(lost));
  return list;
}

}  // namespace orbitfuse::network
