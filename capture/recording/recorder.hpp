// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "capture/frame_source.hpp"
#include "capture/recording/session_folder.hpp"
#include "capture/recording/session_writer.hpp"
#include "core/progress.hpp"

namespace orbitfuse {

/// What a full queue does to the frame that arrives.
enum class Backpressure {
  drop_newest,  ///< live cameras: the frame is dropped and counted
  wait,         ///< replay, synthetic, stills: the source waits; what it cannot write comes again
};

struct RecorderOptions {
  int queue_frames = 16;  ///< per camera; bounds memory when the disk is slow
  Backpressure backpressure = Backpressure::drop_newest;
  std::chrono::milliseconds next_timeout{
      200};  ///< how often a stream that delivers nothing is left
  /// Without a frame for longer than this a camera is silent. Longer than one damaged frame may
  /// take: a driver waits 0.3 s for its missing packets, and those behind it wait with it.
  std::chrono::milliseconds silence{500};
  /// Per device, the id after all that earlier recordings of the session account for: ids that its
  /// stream skips from there on are missing.
  std::map<std::string, std::uint64_t> next_ids;
  /// Per device, K a count of its newest thermal frame in the session; none: centikelvin. Frames of
  /// another scale are told by an event.
  std::map<std::string, double> stored_kelvin_per_count;
  /// Below this recording stops with an error.
  std::uint64_t min_free_bytes = min_free_session_bytes;

  Status validate() const;
};

/// A camera that was lost, or a folder that is gone, and has not come back.
struct Absence {
  double seconds = 0;
  std::string why;
};

/// Live figures of one camera; received + lost == last_id - first_id + 1.
struct StreamStatus {
  std::string device;
  Modality modality = Modality::visible;
  std::uint64_t received = 0, lost = 0, first_id = 0, last_id = 0;
  /// The parts of lost: never came, came damaged, the disk was too slow, could not be written.
  std::uint64_t missing = 0, rejected = 0, dropped = 0, unwritten = 0;
  bool silent = false, ended = false;
  std::optional<Absence> away;                ///< at the end: until the end
  std::uint64_t passed_over = 0;              ///< files that were no frames
  std::vector<std::string> passed_over_last;  ///< up to three: name and why
  std::string rejected_last;   ///< the newest that came damaged: why, of files with the name
  std::uint64_t repeated = 0;  ///< frames that came again under a settled number
  std::string notice;  ///< what the operator should look into: "moved", "twin", "look-alike", ...
  /// The latest word on shutter corrections, and how many there were.
  std::string correction;
  std::uint64_t corrections = 0;
  std::optional<FrameRecord> latest;

  /// Whether a frame came at all; before, the ids say nothing.
  bool any() const { return received + lost > 0; }
};

/// Records several cameras into one session: a capture thread per camera, a bounded queue each,
/// one writer thread each.
class Recorder {
 public:
  Recorder(SessionWriter& writer, RecorderOptions options);
  /// `on_frame` (optional) is called from writer threads after the frame is on disk.
  using OnFrame = std::function<void(const StoredFrame&)>;
  OnFrame on_frame;

  /// Runs until every source ended, `progress` is cancelled or an error occurs. All accounting is
  /// written to the manifest in each of these cases; close() of the writer is the caller's. A
  /// camera that is away at the end, or never delivered, is a device error: its stream is not
  /// complete.
  Status run(const std::vector<FrameSource*>& sources, const Progress& progress = {});
  std::vector<StreamStatus> status() const;

  struct Channel;  ///< one camera's queue, threads and counters (recorder.cpp)

 private:
  SessionWriter& writer_;
  RecorderOptions options_;
  mutable std::mutex mutex_;
  std::vector<std::shared_ptr<Channel>> channels_;
};

}  // namespace orbitfuse
