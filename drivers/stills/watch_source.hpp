// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "capture/frame_source.hpp"

namespace orbitfuse {

struct StillPhoto;

struct WatchOptions {
  std::filesystem::path folder;        ///< where photos appear: a card, a tether, a phone's sync
  std::string device_id = "visible0";  ///< key in the session
  Modality modality = Modality::visible;
  bool existing = false;     ///< also what is there already
  bool accept_gray = false;  ///< thermal: also 8-bit images, which have no temperatures
  std::chrono::milliseconds settle{
      1500};  ///< a file that nobody announces is whole after this calm
  std::chrono::milliseconds rescan{500};
  std::chrono::milliseconds give_up{
      15000};  ///< a file cut off stays unread this long before it is rejected

  Status validate() const;
};

/// Photos and radiometric JPEGs that appear in a folder, as frames. A file that doesn't decode yet
/// is tried again when it grows and rejected when it stays damaged; the same content under another
/// name comes once (event "duplicate"); files of the other modality and of other formats are passed
/// over (event "ignored"), so that one folder can serve a visible and a thermal source. All photos
/// of one source are of one camera, lens and size, because they share intrinsics: others are
/// rejected. After resume() neither photos of the earlier recording nor those of another camera
/// come, and what it rejected is passed over while it is as damaged as it was. Frames carry the
/// flag "still". Files are read, never changed.
class WatchSource final : public FrameSource {
 public:
  explicit WatchSource(WatchOptions options);
  ~WatchSource() override;

  /// Model, serial and lens are known from the first frame on.
  DeviceInfo describe() const override;
  Status start() override;
  Result<Delivery> next(std::chrono::milliseconds timeout) override;
  void stop() override;
  std::vector<Delivery> unfinished() override;
  bool can_wait() const override { return true; }
  bool resume(const Earlier& earlier) override;
  void store_no_finer_than(double kelvin_per_count) override;

 private:
  struct Reader;
  struct Attempt {
    std::filesystem::path file;
    std::chrono::steady_clock::time_point first_try, next_try;
    std::optional<std::string> why = {};  ///< it could not be read, if it was tried
  };
  /// Or an event "ignored", where an earlier recording rejected it for the same.
  Delivery rejection(const std::string& name, const std::string& why);
  std::optional<Delivery> take(Attempt attempt);
  void know_camera(const StillPhoto& still);
  /// Flags the frame of a file, and tells what of the file is not as it looks.
  void tell(const StillPhoto& still, const std::string& name, Frame& frame);
  /// Of the first file of a matter; a folder of one program's files has it in each.
  void tell_once(const char* matter, EventKind kind, std::string words, bool kept = false);

  WatchOptions options_;
  std::unique_ptr<Reader> reader_;
  mutable std::mutex mutex_;
  DeviceInfo info_;
  std::string camera_key_;  ///< of the first photo; empty before
  std::deque<Attempt> queue_;
  std::set<std::string> seen_hashes_;
  std::set<std::pair<std::string, std::optional<std::int64_t>>>
      seen_files_;                         ///< of an earlier recording: name, time
  std::set<std::string> rejected_before_;  ///< GapRecord::reason
  std::int64_t resumed_at_ns_ = 0;
  bool resumed_ = false;  ///< info_ is the session's word
  std::uint64_t next_id_ = 0;
  bool gone_told_ = false;
  std::set<std::string> told_;    ///< matters
  std::deque<Delivery> pending_;  ///< goes before the next photo
};

}  // namespace orbitfuse
