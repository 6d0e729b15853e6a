// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "recon/poses/estimate/feature_level.hpp"
#include "recon/poses/estimate_poses.hpp"
#include "recon/poses/sfm/sfm_ladder.hpp"

namespace orbitfuse {

/// Which of the models that the attempts of a ladder make is the answer: the believed one with most
/// views, if the attempt doesn't say what makes its model the better one. Every attempt becomes a
/// LadderStep. Session, frames and steps have to outlive it.
class ModelSelection {
 public:
  ModelSelection(const Session& session, const std::vector<const FrameRecord*>& frames,
                 std::vector<LadderStep>& steps)
      : session_(session), frames_(frames), steps_(steps) {}

  using Better = std::function<bool(const Reconstruction& model, const Reconstruction& best)>;
  static bool more_views(const Reconstruction& model, const Reconstruction& best) {
    return model.views.size() > best.views.size();
  }

  /// Judges a model of the level's features and keeps it where it is believed and better than the
  /// best one: true then. The level has to stay where it is.
  bool consider(const std::string& attempt, const std::string& found, Reconstruction model,
                FeatureLevel& level, const Better& better = more_views,
                const BundleOptions& bundle = {});
  /// An attempt that made no model.
  void note_fallen(const std::string& attempt, const std::string& why);

  bool has_best() const { return best_.has_value(); }
  const Reconstruction& best() const { return best_->poses.reconstruction; }
  FeatureLevel& best_level() const { return *best_level_; }  ///< whose features the best model has
  /// The largest model that is only too small: nothing else speaks against it. nullptr: none.
  const Reconstruction* part() const { return part_ ? &part_->poses.reconstruction : nullptr; }
  /// There being no best one, the part is that where it has the share of the views that stations
  /// make enough and they and the matches agree with it; later models need no more views either.
  bool take_part();
  /// The best one is the answer; its step says so.
  ModalityPoses& settle();

 private:
  /// As the level was told, but for the share of the views where a part had to do.
  PoseOptions asked_of(const FeatureLevel& level) const;
  bool part_could_stand() const;
  bool only_too_small(const JudgedModel& judged, PoseOptions options) const;
  bool matches_contradict(const FeatureLevel& level, JudgedModel& judged) const;
  LadderStep fallen(const std::string& attempt, const std::string& why) const;
  void record(LadderStep step);

  using Clock = std::chrono::steady_clock;
  const Session& session_;
  const std::vector<const FrameRecord*>& frames_;
  std::vector<LadderStep>& steps_;
  std::optional<JudgedModel> best_;
  FeatureLevel* best_level_ = nullptr;
  std::optional<JudgedModel> part_;
  FeatureLevel* part_level_ = nullptr;
  std::size_t best_step_ = 0, part_step_ = 0;
  bool took_part_ = false;
  Clock::time_point since_ = Clock::now();
};

}  // namespace orbitfuse
