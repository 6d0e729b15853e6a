// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "app/recording/prepared_source.hpp"
#include "capture/live/live_guide.hpp"
#include "capture/live/live_state.hpp"
#include "capture/recording/latest_frame.hpp"
#include "capture/recording/recorder.hpp"

namespace orbitfuse::recording {

struct RecordingOptions {
  std::filesystem::path session;
  bool resume = false;              ///< go on with a session instead of making one
  bool live = false;                ///< drop frames rather than wait when the disk is slow
  bool choose_stations = false;     ///< frames are tracking frames until the guide chooses them
  double seconds = 0;               ///< stop by itself after this long; 0: never
  bool stop_when_complete = false;  ///< stop by itself when every sector is done
  std::optional<LiveGuideOptions> guide;
  std::map<std::string, std::string> notes;
  std::uint64_t min_free_bytes = min_free_session_bytes;  ///< below this nothing is recorded

  Status validate() const;
};

/// Whether the folder and its disk would take the recording; nothing is left there.
Status check_folder(const RecordingOptions& options);

/// How a recording ended.
enum class Ending { source_over, time_over, complete, stopped };

/// One recording of some cameras into one session. prepare, run and finish are called in turn from
/// one thread; the others from any.
class Recording {
 public:
  Recording(std::vector<std::unique_ptr<FrameSource>> sources, RecordingOptions options,
            PositionFinder finder = {});
  ~Recording();

  /// Starts the cameras and shows what those that don't wait see (latest()) until `over` says so.
  /// Nothing is recorded; for an operator who aims first. May be left out.
  Status show_until(const std::function<bool()>& over, const std::atomic<bool>* cancel = nullptr);
  /// Starts the cameras, then makes or reopens the session. Nothing is left behind on failure, nor
  /// where `cancel` comes true: a camera that is just then being opened is not waited for.
  Status prepare(const std::atomic<bool>* cancel = nullptr);
  /// Records until the sources end, the time is over, the guide is complete, request_stop() or
  /// `cancel`; then closes the session. On an error the accounting is in the manifest and the
  /// session stays incomplete. `tick` is called a few times a second.
  Result<Ending> run(const std::atomic<bool>* cancel, const std::function<void()>& tick = {});
  Result<std::string> request_stop();
  bool stop_requested() const { return stop_; }

  std::vector<StreamStatus> status() const;
  /// Everything the page and the terminal show; also before prepare() and after run().
  LiveState state() const;
  /// The newest image of a modality; nothing: none yet.
  std::optional<LatestFrame> latest(Modality modality) const;
  /// What the operator asks for; in words what comes of it, or an error that says why nothing does.
  Result<std::string> operator_at_station();
  /// A shutter correction (NUC) of every camera that has one, now rather than at a station.
  Result<std::string> request_correction();
  LiveGuide* guide() { return guide_.get(); }
  const std::vector<DeviceInfo>& devices() const { return devices_; }
  const std::filesystem::path& folder() const { return options_.session; }

 private:
  struct Rate {
    std::uint64_t received = 0;
    double hz = 0;
  };
  static Status start(const std::shared_ptr<PreparedSource>& source,
                      const std::atomic<bool>* cancel);
  Status fit_into(const std::optional<Session>& earlier);
  void show(FrameSource& source, const std::atomic<bool>& over);
  void keep_latest(LatestFrame frame);
  void measure_rates();

  RecordingOptions options_;
  PositionFinder finder_;
  std::vector<std::shared_ptr<PreparedSource>> sources_;  ///< outlived by one that hangs
  std::vector<DeviceInfo> devices_;
  std::map<std::string, std::uint64_t> next_ids_;          ///< RecorderOptions::next_ids
  std::map<std::string, double> stored_kelvin_per_count_;  ///< the same
  std::unique_ptr<SessionWriter> writer_;
  std::unique_ptr<LiveGuide> guide_;
  std::unique_ptr<Recorder> recorder_;
  std::atomic<bool> stop_{false}, running_{false}, showing_{false};
  bool shown_ = false;
  mutable std::mutex latest_mutex_;
  std::map<Modality, LatestFrame> latest_;
  mutable std::mutex mutex_;  ///< guards what the page's threads see of a recording
  std::chrono::steady_clock::time_point started_{}, ended_{}, rates_measured_{};
  std::map<std::string, Rate> rates_;
};

}  // namespace orbitfuse::recording
