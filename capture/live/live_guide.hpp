// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "capture/guide/coverage.hpp"
#include "capture/live/chosen_frames.hpp"
#include "capture/live/position_policy.hpp"
#include "capture/live/sharpness_reference.hpp"
#include "capture/live/turntable.hpp"
#include "capture/recording/session_writer.hpp"
#include "core/temperature.hpp"

namespace orbitfuse {

struct LiveGuideOptions {
  OrbitPlan plan;
  CoverageOptions coverage;
  double looks_per_second = 4;  ///< per camera; finding the mat costs 5-30 ms a look
  double unseen_after_s = 1.0;  ///< a position older than this is no longer where the camera is
  /// After the key a frame counts only when those before and after it show the same, up to this
  /// share of the image's width: half a percent a frame at 30 Hz is 4 degrees a second at 25.
  double key_motion = 0.005;
  /// The object stands on a turntable: each key is this much further in azimuth, negative for a
  /// table that turns the other way; a full turn later it is the next loop. A photo shows the table
  /// where the last key before its time put it, however late it arrives; one whose time does not
  /// tell is refused. Without keys each photo of a camera is a step. Absent: there is no turntable.
  std::optional<double> turntable_step_deg;
  /// Every frame will carry its station (replay, synthetic): no key is asked for.
  bool stations_come_with_frames = false;

  Status validate() const;
};

/// What one camera shows at the moment.
struct LiveCamera {
  Modality modality = Modality::visible;
  std::optional<OrbitPosition> position;
  Refusal refusal = Refusal::none;  ///< of the latest frame that was judged
  std::string instruction;          ///< what to do next for this modality, less what is awaited
  Awaited awaits = Awaited::nothing;
  std::optional<OrbitPosition> target;  ///< the station to go to; nothing: all are done
  int done = 0, of = 0;                 ///< stations
  std::string latest_file, judged_file;
};

/// The instruction in the words of a terminal, where the key is Enter, or of the page, where it is
/// a button.
enum class Operator { at_terminal, at_page };
std::string instruction_for(const LiveCamera& camera, Operator where);

/// Follows a recording and decides which stations are done. Every frame comes here after it is on
/// disk. Where it was taken is known by its camera's PositionPolicy; what has to be looked for in
/// images is looked for a few times a second on a thread of its own, so that recording never waits
/// for it. The frame chosen for a sector is marked in the manifest (SessionWriter::amend); one that
/// it replaces becomes a tracking frame.
class LiveGuide {
 public:
  /// `writer` outlives the guide. Without `finder` only stations and keys give positions.
  LiveGuide(SessionWriter& writer, LiveGuideOptions options, PositionFinder finder = {});
  ~LiveGuide();

  /// What an earlier recording of the session stored, before the first add(): sectors that it
  /// filled stay filled, and the turntable goes on one step after the last recorded station.
  void resume(const std::vector<FrameRecord>& earlier);
  /// From any thread; fast unless the frame carries a station. `pixels`: its image as it was
  /// decoded for the disk, upright; empty: it is read back when it is needed. `kelvin_per_count`
  /// of thermal ones: neighbours of another scale are compared in kelvin.
  void add(const FrameRecord& frame, const cv::Mat& pixels = {},
           double kelvin_per_count = kelvin_per_dn);
  /// The operator stands at the next station, or has turned the table by a step: for each modality
  /// the next good frame is it; of a video, the next between two that show the same.
  /// `time_ns`: when (UTC epoch); absent: now. In words what is taken next; usage error where the
  /// frames or photos tell by themselves.
  Result<std::string> operator_at_station(std::optional<std::int64_t> time_ns = {});

  /// Judges what was stored and ends the looking; call it before the writer closes the session.
  void finish();

  /// In the order of the plan's modalities.
  std::vector<LiveCamera> cameras() const;
  std::vector<Sector> sectors() const;
  const OrbitPlan& plan() const { return options_.plan; }
  int done_count(Modality modality) const;
  bool complete() const;
  /// The first that failed when a chosen station was noted; recording goes on without.
  std::optional<Error> error() const;

 private:
  struct Look {
    FrameRecord frame;
    cv::Mat image;  ///< empty: to be read back
    double kelvin_per_count = kelvin_per_dn;
  };
  struct Camera {
    LiveCamera shown;
    SharpnessReference sharpness;
    std::optional<OrbitPosition> position;
    std::optional<std::int64_t> position_time_ns;  ///< of the frame that it was seen in
    std::unique_ptr<PositionPolicy> policy;
    bool stations_come = false;   ///< with its frames, whatever was expected
    std::optional<Look> waiting;  ///< newest frame of a video not looked at yet
    std::deque<Look> photos;      ///< not looked at yet: each was taken on purpose
    std::optional<Look> next_to_look();
    std::optional<OrbitPosition> announced;  ///< where the next good frame is
    std::deque<Look> since_key;              ///< video frames, the newest up to three
    ChosenFrames chosen;
  };
  void add_at_station(Camera& camera, const FrameRecord& frame);
  void find_mat_in_frames();
  void judge(Camera& camera, const FrameRecord& frame,
             const std::optional<OrbitPosition>& position);
  std::unique_ptr<PositionPolicy> policy_for(Modality modality);
  void say_next(Camera& camera, const std::optional<OrbitPosition>& position, Refusal last) const;
  void place(Camera& camera, const Look& look);
  void judge_between_neighbours(Camera& camera, const Look& look);
  bool needs_image(const FrameRecord& frame);
  void judge_announced(Camera& camera, const FrameRecord& frame);
  void set_position(Camera& camera, OrbitPosition position, std::optional<std::int64_t> time_ns);

  SessionWriter& writer_;
  LiveGuideOptions options_;
  PositionFinder finder_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Coverage coverage_;
  std::map<Modality, Camera> cameras_;
  std::optional<Turntable> table_;
  std::optional<Error> error_;
  bool over_ = false;
  std::jthread looker_;
};

}  // namespace orbitfuse
