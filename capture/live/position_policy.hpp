// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "capture/guide/coverage.hpp"
#include "capture/live/turntable.hpp"
#include "core/session/session.hpp"

// Ways of knowing where a camera stands. Each camera of a guide has one.
namespace orbitfuse {

/// Finds the camera in an upright image (CV_8UC3 BGR, CV_8UC1 or CV_16UC1 centikelvin).
using PositionFinder = std::function<std::optional<OrbitPosition>(const cv::Mat&, Modality)>;

/// How the operator says that a step is done.
enum class Awaited { nothing, key, photo, key_or_photo };

/// What to do next.
struct GuideStep {
  std::string words;  ///< without what is awaited
  Awaited awaits = Awaited::nothing;
};

/// What a policy is told of its camera when it words the next step.
struct CameraSight {
  std::optional<OrbitPosition> position;
  Refusal last = Refusal::none;  ///< of the latest frame that was judged
  bool announced = false;        ///< the next good frame is a station already
  bool any_frame = false;
};

/// The operator's key.
struct KeyPress {
  std::int64_t time_ns = 0;
  std::optional<int> number = {};  ///< of a turntable's keys, counted from 1
};

class PositionPolicy {
 public:
  virtual ~PositionPolicy() = default;

  /// Where the camera is announced to stand by the key; nothing: the key says nothing of it.
  virtual std::optional<OrbitPosition> at_key(const KeyPress& key) = 0;
  /// Where a photo was taken, as far as that is known without a look at it.
  virtual std::optional<OrbitPosition> of_photo(const FrameRecord& /*photo*/) { return {}; }
  /// What looks for the camera in its images; nullptr: nothing does.
  virtual const PositionFinder* finder() const { return nullptr; }
  /// The last station that an earlier recording has of the camera.
  virtual void resume_at(const Station& /*station*/) {}
  /// While stations are missing.
  virtual GuideStep next_step(const CameraSight& sight) const = 0;
};

/// The frames carry their stations (replay, synthetic): no key is needed.
std::unique_ptr<PositionPolicy> carried_stations(const Coverage& coverage, Modality modality);
/// The operator's key: it is the next missing station.
std::unique_ptr<PositionPolicy> operator_key(const Coverage& coverage, Modality modality);
/// What `finder` sees in the images; the key is a station all the same.
std::unique_ptr<PositionPolicy> mat_in_view(const Coverage& coverage, Modality modality,
                                            const PositionFinder& finder);
/// A turntable, which all cameras share. A photo shows the table where the last key before its time
/// put it, however late it arrives; one whose time does not tell is of no sure position. Without
/// keys each photo of the camera is a step.
std::unique_ptr<PositionPolicy> turntable_steps(const Coverage& coverage, Turntable& table);

}  // namespace orbitfuse
