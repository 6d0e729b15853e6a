// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/watch_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <optional>
#include <utility>

#include "core/system/file_io.hpp"
#include "core/system/utc_now.hpp"
#include "core/temperature.hpp"
#include "drivers/stills/folder_watch.hpp"
#include "drivers/stills/image_list.hpp"
#include "drivers/stills/still_photo.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds retry_every{250};

/// A recording of a FLIR camera grows while it is made: import reads it when it is whole.
bool has_image_name(Modality modality, const fs::path& file) {
  return has_image_extension(modality, file) && unread_kind(file) != "FLIR recording";
}

std::optional<std::int64_t> written_ns(const fs::path& file) {
  std::error_code error;
  const auto written = fs::last_write_time(file, error);
  if (error) return std::nullopt;
  const auto utc = std::chrono::file_clock::to_sys(written);
  return std::chrono::duration_cast<std::chrono::nanoseconds>(utc.time_since_epoch()).count();
}

}  // namespace

struct WatchSource::Reader {
  explicit Reader(const WatchOptions& options)
      : watch(options.folder, options.settle, options.rescan), decoder(import) {}
  FolderWatch watch;
  ImportOptions import;  ///< outlives the decoder, which refers to it
  ThermalDecoder decoder;
};

Status WatchOptions::validate() const {
  if (folder.empty())
    return fail(ErrorKind::usage, "stills.folder", "empty", "name the folder where photos arrive");
  if (settle.count() <= 0 || rescan.count() <= 0 || give_up < settle) {
    return fail(ErrorKind::usage, "stills.settle", "not positive, or longer than give_up",
                "must be > 0 and at most give_up");
  }
  return {};
}

WatchSource::WatchSource(WatchOptions options)
    : options_(std::move(options)), reader_(std::make_unique<Reader>(options_)) {
  info_.id = options_.device_id;
  info_.modality = options_.modality;
  info_.driver = "stills";
}

WatchSource::~WatchSource() = default;

DeviceInfo WatchSource::describe() const {
  const std::lock_guard lock(mutex_);
  return info_;
}

Status WatchSource::start() {
  ORBITFUSE_TRY(options_.validate());
  return reader_->watch.open(options_.existing);
}

bool WatchSource::resume(const Earlier& earlier) {
  const std::lock_guard lock(mutex_);
  const std::string id = info_.id;
  info_ = earlier.device;
  info_.id = id;
  resumed_ = !info_.model.empty() || !info_.serial.empty();
  for (const FrameRecord& frame : earlier.frames) {
    seen_hashes_.insert(frame.content_hash);
    seen_files_.insert({frame.source, frame.host_time_ns});  // thermal images are stored decoded
  }
  for (const GapRecord& gap : earlier.gaps) rejected_before_.insert(gap.reason);
  resumed_at_ns_ = utc_now_ns();
  return false;
}

void WatchSource::store_no_finer_than(double kelvin_per_count) {
  reader_->decoder.store_no_finer_than(kelvin_per_count);
}

Delivery WatchSource::rejection(const std::string& name, const std::string& why) {
  Delivery delivery;
  delivery.kind = Delivery::Kind::rejected;
  delivery.reason = name + ": " + why;
  // One that came since is another file, whatever its name: cards count from 1 again.
  const auto written = written_ns(options_.folder / name);
  if (written && *written < resumed_at_ns_ &&
      rejected_before_.contains(rejected_because + delivery.reason))
    return event_delivery(EventKind::ignored, delivery.reason + ", as before");
  delivery.frame.id = next_id_++;
  return delivery;
}

/// Whoever took these photos thinks that they are in the session.
std::vector<Delivery> WatchSource::unfinished() {
  std::vector<Delivery> list(pending_.begin(), pending_.end());
  pending_.clear();
  const auto unread = [&](const fs::path& file) {
    std::error_code error;
    const bool empty = fs::file_size(file, error) == 0 && !error;
    list.push_back(event_delivery(
        EventKind::ignored,
        file.filename().string() + (empty ? ": an empty file"
                                          : ": not read before the recording ended; go on with "
                                            "--resume and existing=yes")));
  };
  for (const Attempt& attempt : queue_) {
    if (attempt.why)
      list.push_back(rejection(attempt.file.filename().string(), *attempt.why));
    else
      unread(attempt.file);
  }
  for (const fs::path& file : reader_->watch.untold()) {
    const bool waiting =
        std::any_of(queue_.begin(), queue_.end(), [&](const Attempt& a) { return a.file == file; });
    if (!waiting && has_image_name(options_.modality, file)) unread(file);
  }
  queue_.clear();
  return list;
}

void WatchSource::stop() { reader_->watch.close(); }

Result<Delivery> WatchSource::next(std::chrono::milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  while (true) {
    if (!pending_.empty()) {
      Delivery delivery = std::move(pending_.front());
      pending_.pop_front();
      return delivery;
    }
    const auto due = std::find_if(queue_.begin(), queue_.end(),
                                  [](const Attempt& a) { return a.next_try <= Clock::now(); });
    if (due != queue_.end()) {
      Attempt attempt = std::move(*due);
      queue_.erase(due);
      if (std::optional<Delivery> delivery = take(std::move(attempt))) return std::move(*delivery);
      continue;
    }
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now());
    if (left.count() <= 0) return Delivery{};
    const auto found = reader_->watch.wait(std::min(left, queue_.empty() ? left : retry_every));
    if (reader_->watch.folder_gone() != gone_told_) {
      gone_told_ = !gone_told_;
      return event_delivery(gone_told_ ? EventKind::disconnected : EventKind::reconnected,
                            options_.folder.string());
    }
    for (const fs::path& file : found) {
      // Written again while it waits for its rest: one attempt is enough.
      std::erase_if(queue_, [&](const Attempt& a) { return a.file == file; });
      queue_.push_back({file, Clock::now(), Clock::now(), {}});
    }
  }
}

/// One look at a file; nothing when it has to be tried again.
std::optional<Delivery> WatchSource::take(Attempt attempt) {
  const std::string name = attempt.file.filename().string();
  if (!has_image_name(options_.modality, attempt.file)) {
    return event_delivery(
        EventKind::ignored,
        name + ": not a JPEG, PNG, TIFF, BMP or (photos) HEIC (set the camera to one of these)");
  }
  const bool thermal = options_.modality == Modality::thermal;
  const bool radiometric = is_radiometric(attempt.file);
  if (!thermal && radiometric)
    return event_delivery(EventKind::ignored, name + ": a thermal image, not a photo");
  Result<StillPhoto> still = thermal ? read_thermal_still(attempt.file, reader_->decoder)
                                     : read_visible_still(attempt.file);
  Delivery delivery;
  if (!still) {
    std::error_code error;
    if (!fs::exists(attempt.file, error))
      return event_delivery(EventKind::ignored, name + ": vanished before it was read");
    // A photo: where one camera writes both into one folder, half of the files are such.
    if (thermal && !radiometric && read_visible_still(attempt.file))
      return event_delivery(EventKind::ignored, name + ": " + still.error().found);
    if (Clock::now() - attempt.first_try < options_.give_up) {
      attempt.next_try = Clock::now() + retry_every;
      attempt.why = still.error().found;
      queue_.push_back(std::move(attempt));
      return std::nullopt;
    }
    return rejection(name, still.error().found);
  }
  if (thermal && still->frame.thermal_is_gray && !options_.accept_gray) {
    return event_delivery(EventKind::ignored,
                          name + ": no temperatures in it (gray=yes takes it all the same)");
  }
  const Result<std::string> bytes = read_file(attempt.file, max_image_bytes);
  if (!bytes || !seen_hashes_.insert(content_hash(*bytes)).second) {
    know_camera(*still);
    return event_delivery(EventKind::duplicate, name + ": the same image came before");
  }
  delivery.frame = std::move(still->frame);
  if (!delivery.frame.host_time_ns) {
    delivery.frame.host_time_ns = written_ns(attempt.file);
    delivery.frame.flag(FrameFlag::file_time);  // of copying, perhaps
  }
  delivery.frame.source =
      (attempt.file.parent_path().filename() / attempt.file.filename()).string();
  if (seen_files_.contains({delivery.frame.source, delivery.frame.host_time_ns})) {
    know_camera(*still);
    return event_delivery(EventKind::duplicate, name + ": in the session already");
  }
  {
    const std::lock_guard lock(mutex_);
    if (resumed_ && (still->camera.model != info_.model || still->camera.serial != info_.serial))
      return rejection(name, "of " + still->camera.model + " " + still->camera.serial +
                                 ", the session's are of " + info_.model + " " + info_.serial);
    if (camera_key_.empty()) {
      camera_key_ = still->key();
      info_.model = still->camera.model;
      info_.serial = still->camera.serial;
      info_.lens = still->camera.lens;
    } else if (still->key() != camera_key_) {
      return rejection(name, "another camera, lens or image size than the first (" +
                                 still->described() + "; give it a folder of its own)");
    }
  }
  delivery.frame.id = next_id_++;
  delivery.kind = Delivery::Kind::frame;
  delivery.frame.flag(FrameFlag::still);
  tell(*still, name, delivery.frame);
  return delivery;
}

/// From a frame of the session: all of its camera's are of one lens and size.
void WatchSource::know_camera(const StillPhoto& still) {
  const std::lock_guard lock(mutex_);
  if (camera_key_.empty()) camera_key_ = still.key();
}

void WatchSource::tell(const StillPhoto& still, const std::string& name, Frame& frame) {
  if (still.without_temperature > 0) {
    frame.flag(FrameFlag::clipped);
    tell_once("clipped", EventKind::clipped,
              fmt::format("{}: {} samples without a temperature, or hotter than {:.0f} C: dead "
                          "pixels, here and in all frames with the flag clipped",
                          name, still.without_temperature,
                          celsius_from_kelvin(65535 * frame.kelvin_per_count)));
  }
  if (still.transparent > 0) {
    frame.flag(FrameFlag::transparent);
    tell_once("transparent", EventKind::transparent,
              fmt::format("{}: {:.3g} % of its pixels are transparent; alpha is dropped, and what "
                          "colour lies behind it is taken for the scene, here and in all frames "
                          "with the flag transparent: send the images as they were taken",
                          name, 100 * still.transparent));
  }
  if (const std::string how = still.how_held(); !how.empty())
    tell_once(still.lies_across ? "across" : "turned", EventKind::held,
              fmt::format("{}: {} (told of the first such file)", name, how));
  if (!still.two_scales.empty())
    tell_once("scales", EventKind::scale,
              fmt::format("{}: {} (told of the first such file)", name, still.two_scales));
  if (!still.other_pages.empty())
    tell_once("pages", EventKind::ignored,
              fmt::format("{}: {} (told of the first such file)", name, still.other_pages), true);
}

void WatchSource::tell_once(const char* matter, EventKind kind, std::string words, bool kept) {
  if (!told_.insert(matter).second) return;
  pending_.push_back(event_delivery(kind, std::move(words)));
  pending_.back().kept = kept;
}

}  // namespace orbitfuse
