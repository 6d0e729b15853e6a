// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate/model_selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "recon/poses/estimate/mistaken_pairs.hpp"
#include "recon/poses/sfm/held_matches.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {
namespace {

/// Share of the views from which on a model that can't stand alone is worth completing.
constexpr double part_of_a_model = 0.5;
/// From which on it can, where stations confirm it and no attempt made a larger one. Chosen on
/// `plane` and `forklift` in noisy pictures, 18 and 19 views of 24, both right
/// (docs/notes/poses_visible.md).
constexpr double part_that_stands = 0.7;

/// Whether its stations speak against a model. Most of its views looking from another side is an
/// error of quality.
bool against_stations(const Result<JudgedModel>& judged, const Session& session,
                      const PoseOptions& options) {
  if (!judged) return judged.error().kind == ErrorKind::quality;
  return stations_contradict(judged->poses.reconstruction.views, session, options);
}

}  // namespace

bool ModelSelection::consider(const std::string& attempt, const std::string& found,
                              Reconstruction model, FeatureLevel& level, const Better& better,
                              const BundleOptions& bundle) {
  LadderStep step = fallen(attempt, found);
  bool taken = false;
  if (model.views.size() < 2) {
    step.why += "; no model";
  } else {
    Result<JudgedModel> judged =
        judge_model(std::move(model), session_, frames_, asked_of(level), bundle);
    const bool contradicted = judged && judged->believed && matches_contradict(level, *judged);
    step.why += "; " + (judged ? judged->why : judged.error().found);
    step.against_stations = against_stations(judged, session_, level.options());
    if (judged) step.posed = static_cast<int>(judged->poses.reconstruction.views.size());
    if (judged && judged->believed && (!best_ || better(judged->poses.reconstruction, best()))) {
      if (best_) steps_[best_step_].bettered = true;
      best_ = std::move(*judged);
      best_step_ = steps_.size();
      best_level_ = &level;
      taken = true;
    } else if (judged && judged->believed) {
      step.why += "; no better than the model before";
    } else if (judged && !contradicted && only_too_small(*judged, level.options()) &&
               (!part_ || (more_views(judged->poses.reconstruction, *part()) &&
                           !matches_contradict(level, *judged)))) {
      part_ = std::move(*judged);
      part_level_ = &level;
      part_step_ = steps_.size();
    }
  }
  record(std::move(step));
  return taken;
}

void ModelSelection::note_fallen(const std::string& attempt, const std::string& why) {
  record(fallen(attempt, why));
}

ModalityPoses& ModelSelection::settle() {
  steps_[best_step_].held = true;
  return best_->poses;
}

/// Nothing but its size speaks against it, nor did the stations or a larger model of another
/// attempt: where the stations were declared wrongly a part of the views may still agree with them.
bool ModelSelection::part_could_stand() const {
  if (best_ || !part_ || part_->poses.posed_ratio() < part_that_stands ||
      part_level_->options().min_posed_ratio > PoseOptions{}.min_posed_ratio)
    return false;
  const auto views = static_cast<int>(part()->views.size());
  if (std::any_of(steps_.begin(), steps_.end(), [&](const LadderStep& step) {
        return step.against_stations || step.posed > views;
      }))
    return false;
  const auto fit = fit_stations(part()->views, session_);
  return fit && fit->folded.empty() && fit->views >= part_that_stands * views;
}

bool ModelSelection::take_part() {
  if (!part_could_stand()) return false;
  const std::size_t said = part_->why.size();
  const bool contradicted = matches_contradict(*part_level_, *part_);
  steps_[part_step_].why += part_->why.substr(said);
  if (contradicted) return false;
  steps_[part_step_].why += "; taken, for no attempt placed more";
  best_ = std::move(*part_);
  best_step_ = part_step_;
  best_level_ = part_level_;
  part_.reset();
  took_part_ = true;
  return true;
}

PoseOptions ModelSelection::asked_of(const FeatureLevel& level) const {
  PoseOptions options = level.options();
  if (took_part_) options.min_posed_ratio = std::min(options.min_posed_ratio, part_that_stands);
  return options;
}

/// Its views agree with their stations.
bool ModelSelection::only_too_small(const JudgedModel& judged, PoseOptions options) const {
  options.min_posed_ratio = part_of_a_model;
  ModalityPoses poses = judged.poses;
  std::string why;
  return passes_gates(poses, session_, options, why);
}

/// Whether the level's verified matches speak against the model, which then is not believed: on
/// repeated structure a wrong model has small residuals, for it keeps the matches that fit it.
bool ModelSelection::matches_contradict(const FeatureLevel& level, JudgedModel& judged) const {
  const auto graph = level.graph();
  if (!graph) {
    judged.why += ", its matches can't be asked: " + graph.error().found;
    return false;
  }
  const std::vector<PosedView>& views = judged.poses.reconstruction.views;
  const PosedFrames posed = posed_frames(*graph, judged.poses.reconstruction);
  const Eigen::Vector3d up =
      canonical_from_world(views, {}).rotation.conjugate() * Eigen::Vector3d::UnitZ();
  const HeldMatches held =
      held_matches(*graph, posed,
                   mistaken_pairs(*graph, posed, fit_stations(views, session_), views.size(), up));
  judged.poses.gates["held_matches"] = held.share;
  judged.poses.gates["contradicted_matches"] = held.contradicted_share;
  judged.why += fmt::format(", {:.0f} % of the matches of pairs hold", 100 * held.share);
  if (held.contradicted > 0)
    judged.why += fmt::format(", {:.1f} % in {} pairs that contradict it",
                              100 * held.contradicted_share, held.contradicted);
  if (held.outvoted > 0)
    judged.why += fmt::format(", {} pairs that do are outvoted", held.outvoted);
  if (held.mistaken > 0)
    judged.why += fmt::format(", {} pairs that do contradict the stations as well", held.mistaken);
  if (held.contradict()) judged.believed = false;
  return held.contradict();
}

LadderStep ModelSelection::fallen(const std::string& attempt, const std::string& why) const {
  return {.attempt = attempt, .why = why, .total = static_cast<int>(frames_.size())};
}

void ModelSelection::record(LadderStep step) {
  step.seconds = std::chrono::duration<double>(Clock::now() - since_).count();
  since_ = Clock::now();
  steps_.push_back(std::move(step));
}

}  // namespace orbitfuse
