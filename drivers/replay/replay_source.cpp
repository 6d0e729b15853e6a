// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/replay/replay_source.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <thread>
#include <utility>

#include "capture/recording/resumed_event.hpp"
#include "capture/recording/resumed_ids.hpp"
#include "core/image/image_codec.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse {
namespace {

using Clock = std::chrono::steady_clock;

class ReplaySource : public FrameSource {
 public:
  ReplaySource(const Session& session, const std::string& device, ReplaySpeed speed)
      : session_(session), speed_(speed) {
    if (const DeviceInfo* known = session.device(device)) device_ = *known;
    for (const FrameRecord& frame : session_.frames) {
      if (frame.device == device) records_.push_back(frame);
    }
    // The manifest has the order in which frames reached the disk; a stream has that of its ids.
    std::stable_sort(
        records_.begin(), records_.end(),
        [](const FrameRecord& a, const FrameRecord& b) { return a.sequence < b.sequence; });
    session_.frames.clear();
  }

  DeviceInfo describe() const override { return device_; }

  Status start() override {
    if (records_.empty()) {
      return fail(ErrorKind::input, session_.folder.string(),
                  "no frames of device \"" + device_.id + "\"", "choose a device of the session");
    }
    next_ = 0;
    started_ = Clock::now();
    return {};
  }

  /// Goes on after the last frame that the earlier recording has, in that recording's count.
  bool resume(const Earlier& earlier) override {
    std::map<std::pair<std::string, std::optional<std::int64_t>>, std::uint64_t> recorded;
    for (const FrameRecord& frame : earlier.frames)
      recorded[{frame.content_hash, frame.host_time_ns}] = frame.sequence;
    const auto sequence_of = [&](const FrameRecord& record) -> const std::uint64_t* {
      const auto found = recorded.find({record.content_hash, record.host_time_ns});
      return found == recorded.end() ? nullptr : &found->second;
    };
    std::size_t known = 0;
    for (std::size_t i = 0; i < records_.size(); ++i) {
      const std::uint64_t* sequence = sequence_of(records_[i]);
      if (!sequence) continue;
      ++known;
      next_ = i + 1;
      ids_.go_on(records_[i].sequence, *sequence, earlier.next_id);
    }
    if (known == 0) return false;
    first_ = std::min(next_, records_.size() - 1);
    resumed_ = resumed_event(known, records_.size(), next_ == records_.size());
    return true;
  }

  Result<Delivery> next(std::chrono::milliseconds timeout) override {
    if (resumed_) return *std::exchange(resumed_, std::nullopt);
    Delivery delivery;
    while (next_ < records_.size()) {
      const FrameRecord& record = records_[next_];
      if (!wait_for(record, timeout)) return delivery;  // kind timeout
      ++next_;
      load(record, delivery);
      if (delivery.kind == Delivery::Kind::rejected && ids_.settled(record.sequence))
        continue;  // lost then, too
      delivery.frame.id = ids_.give(record.sequence);
      return delivery;
    }
    delivery.kind = Delivery::Kind::end;
    return delivery;
  }

  void stop() override {}
  bool can_wait() const override { return speed_ == ReplaySpeed::full; }

 private:
  /// False when the frame's moment is further away than the timeout.
  bool wait_for(const FrameRecord& record, std::chrono::milliseconds timeout) {
    const std::optional<std::int64_t> begun_ns = records_[first_].host_time_ns;
    if (speed_ == ReplaySpeed::full || !record.host_time_ns || !begun_ns) return true;
    const auto due = started_ + std::chrono::nanoseconds(
                                    std::max<std::int64_t>(0, *record.host_time_ns - *begun_ns));
    const auto deadline = Clock::now() + timeout;
    std::this_thread::sleep_until(std::min(due, deadline));
    return due <= deadline;
  }

  /// A good frame or a rejected one, without its id.
  void load(const FrameRecord& record, Delivery& delivery) const {
    Frame& frame = delivery.frame;
    delivery.kind = Delivery::Kind::rejected;
    Result<std::string> bytes = read_file(session_.path_of(record));
    if (!bytes) {
      delivery.reason = bytes.error().found;
      return;
    }
    if (!record.content_hash.empty() && content_hash(*bytes) != record.content_hash) {
      delivery.reason = "the file changed since it was recorded";
      return;
    }
    delivery.kind = Delivery::Kind::frame;
    delivery.reason.clear();
    frame.encoded = *std::move(bytes);
    const std::filesystem::path file(record.file);
    const auto counts =
        session_.folder / file.parent_path() / "originals" / (file.stem().string() + ".tiff");
    if (record.has_flag(FrameFlag::raw_counts)) {
      if (const Result<std::string> tiff = read_file(counts)) {
        if (const Result<cv::Mat> original = decode_tiff(*tiff, counts.string()))
          frame.original = *original;
      }
    }
    frame.extension = std::filesystem::path(record.file).extension().string();
    frame.host_time_ns = record.host_time_ns;
    frame.device_time_ns = record.device_time_ns;
    frame.station = record.station;
    frame.tracking = record.tracking;
    frame.thermal_is_gray = record.thermal_is_gray;
    frame.flags = record.flags;
    frame.cam_from_world = record.cam_from_world;
    frame.camera = record.camera;
    frame.source = record.source;
    frame.radiometry = record.radiometry;
  }

  Session session_;
  DeviceInfo device_;
  ReplaySpeed speed_;
  std::vector<FrameRecord> records_;
  std::size_t next_ = 0, first_ = 0;  ///< first_: of this recording; waiting counts from it
  ResumedIds ids_;
  std::optional<Delivery> resumed_;  ///< to be told first
  Clock::time_point started_;
};

}  // namespace

std::unique_ptr<FrameSource> make_replay_source(const Session& session, const std::string& device,
                                                ReplaySpeed speed) {
  return std::make_unique<ReplaySource>(session, device, speed);
}

std::vector<std::unique_ptr<FrameSource>> make_replay_sources(const Session& session,
                                                              ReplaySpeed speed) {
  std::vector<std::unique_ptr<FrameSource>> sources;
  for (const DeviceInfo& device : session.devices)
    sources.push_back(make_replay_source(session, device.id, speed));
  return sources;
}

}  // namespace orbitfuse
