// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate/visible_ladder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "recon/poses/doubts.hpp"
#include "recon/poses/estimate/feature_level.hpp"
#include "recon/poses/estimate/model_selection.hpp"
#include "recon/poses/estimate/placed_elsewhere.hpp"
#include "recon/poses/estimate/refined_tracks.hpp"
#include "recon/poses/estimate/weakest_joint.hpp"
#include "recon/poses/estimate/weakly_held.hpp"
#include "recon/poses/global_sfm/global_mapper.hpp"
#include "recon/poses/sfm/held_matches.hpp"
#include "recon/poses/sfm/resection.hpp"
#include "recon/poses/sfm/sfm_ladder.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;

/// COLMAP's own limits, for what the quick way left out.
constexpr int full_image_side_px = 3200;
constexpr int full_features = 8192;
/// SIFT contrast where the usual features make no model: half as many again, of faint texture. On
/// two walled scenes the global mapper's answer went from 0.22 and 0.64 % of the extent to 0.07 and
/// 0.05.
constexpr double faint_peak_threshold = 0.0025;
/// Without any model all pairs at full settings take a CPU second each, others a fifth of one: up
/// to this many views, of more as many pairs as these have.
constexpr int max_exhaustive_views = 60;
constexpr std::size_t most_pairs = max_exhaustive_views * (max_exhaustive_views - 1) / 2;
/// Features of affine shapes take two CPU seconds a view and half a one a pair: for a single view
/// of 24 they aren't sought.
constexpr double share_worth_affine_shapes = 0.05;

constexpr const char* featureless_why =
    "shows nothing to match (blank, out of focus or overexposed?)";

PoseOptions at_full_settings(PoseOptions options) {
  options.max_image_side_px = std::max(options.max_image_side_px, full_image_side_px);
  options.max_features = std::max(options.max_features, full_features);
  return options;
}

using Better = ModelSelection::Better;

class VisibleLadder {
 public:
  VisibleLadder(const Session& session, const std::vector<const FrameRecord*>& frames,
                const PoseOptions& options, const fs::path& workdir, const Progress& progress,
                std::vector<LadderStep>& steps)
      : session_(session),
        frames_(frames),
        options_(options),
        workdir_(workdir),
        progress_(progress),
        steps_(steps),
        selection_(session, frames, steps),
        total_(static_cast<int>(frames.size())) {}

  Result<ModalityPoses> run() {
    const std::vector<ViewPair> orbit = orbit_pairs(frames_);
    const bool all_are_few = orbit.size() == exhaustive_pairs(total_).size();
    tell(0, "features");
    Result<FeatureLevel> quick =
        FeatureLevel::extract(session_, frames_, options_, workdir_ / "quick", progress_);
    if (!quick && quick.error().kind != ErrorKind::quality) return tl::unexpected(quick.error());
    if (!quick) {
      selection_.note_fallen("COLMAP, orbit pairs", quick.error().found);
      return none_held(steps_, Modality::visible, workdir_);
    }
    ORBITFUSE_TRY(look_at_features(*quick));
    tell(1, "matches of the orbit's pairs");
    ORBITFUSE_TRY(quick->match(orbit, progress_));
    ORBITFUSE_TRY(try_settings(*quick, quick_name_, mapper_ladder().front()));
    if (!selection_.has_best() && selection_.part())
      ORBITFUSE_TRY(try_resection(*quick, "resection on part of a model"));
    if (!selection_.has_best()) ORBITFUSE_TRY(spared(add_faint_features(orbit)));
    FeatureLevel& level = faint_ ? *faint_ : *quick;
    if (!selection_.has_best()) ORBITFUSE_TRY(try_mapper(level, quick_name_));
    if (!complete()) ORBITFUSE_TRY(improve(level, all_are_few));
    selection_.take_part();
    if (selection_.has_best() && steps_.size() > 1) ORBITFUSE_TRY(spared(try_all_matches()));
    if (selection_.has_best()) ORBITFUSE_TRY(spared(try_joining()));
    if (selection_.has_best() && !complete()) {
      ORBITFUSE_TRY(spared(try_rematching()));
      if (rematched_)
        ORBITFUSE_TRY(
            spared(try_resection(selection_.best_level(), "resection on points matched again")));
    }
    if (selection_.has_best()) ORBITFUSE_TRY(spared(try_alignment()));
    if (selection_.has_best()) ORBITFUSE_TRY(spared(try_firmer_features()));
    return answer();
  }

 private:
  /// Where the usual features make no model, those of faint texture take their place.
  Status add_faint_features(const std::vector<ViewPair>& orbit) {
    tell(0, "features of faint texture");
    ORBITFUSE_ASSIGN(FeatureLevel faint,
                     FeatureLevel::extract(session_, frames_, options_, workdir_ / "faint",
                                           progress_, {.peak_threshold = faint_peak_threshold}));
    ORBITFUSE_TRY(look_at_features(faint));
    tell(1, "matches of the orbit's pairs");
    ORBITFUSE_TRY(faint.match(orbit, progress_));
    faint_ = std::move(faint);
    quick_name_ = "faint features, orbit pairs";
    return {};
  }

  /// What further attempts add.
  Status improve(FeatureLevel& quick, bool all_are_few) {
    const auto attempted = [&]() -> Status {
      if (selection_.has_best() || selection_.part())
        ORBITFUSE_TRY(try_resection(quick, selection_.has_best() ? "resection on the quick model"
                                                                 : "resection on part of a model"));
      if (!complete() && !all_are_few) ORBITFUSE_TRY(try_more_pairs(quick));
      if (!complete() && limited_) ORBITFUSE_TRY(try_full_settings());
      if (static_cast<double>(missing().size()) < share_worth_affine_shapes * total_) return {};
      return try_affine_features(holds_more);
    };
    return spared(attempted());
  }

  /// An attempt that breaks down costs no model that is believed already, nor a part that stands.
  Status spared(Status done) {
    if (done || done.error().kind == ErrorKind::cancelled) return done;
    if (!selection_.has_best() && !selection_.take_part()) return done;
    selection_.note_fallen("a further attempt", done.error().message());
    return {};
  }

  void tell(double done, const std::string& what) const {
    progress_.report({"poses.visible", done, 4, {}, what});
  }

  /// Frames in which nothing can be matched can't be posed: no step is taken for them. Where
  /// neither size nor number of features was limited, full settings would find the same ones again.
  Status look_at_features(const FeatureLevel& level) {
    ORBITFUSE_ASSIGN(const FeatureGraph graph, level.graph());
    limited_ = graph.pixel_scale > 1;
    for (int f = 0; f < graph.count(); ++f) {
      const Eigen::Index features = graph.pixels[static_cast<std::size_t>(f)].cols();
      limited_ = limited_ || features >= options_.max_features;
      if (features < ResectionOptions{}.min_inliers)
        featureless_.insert(graph.frames[static_cast<std::size_t>(f)]->file);
    }
    return {};
  }

  bool complete() const { return selection_.has_best() && missing().empty(); }
  std::vector<int> missing() const {
    std::set<std::string> done = featureless_;
    if (selection_.has_best())
      for (const PosedView& view : selection_.best().views) done.insert(view.name);
    std::vector<int> result;
    for (int f = 0; f < total_; ++f)
      if (!done.contains(frames_[static_cast<std::size_t>(f)]->file)) result.push_back(f);
    return result;
  }

  /// The mapper's default settings, then ever more relaxed ones until a model is believed. A
  /// relaxed model that holds few of the verified matches may have followed a repeated pillar: the
  /// global mapper is asked as well then.
  Status try_mapper(FeatureLevel& level, const std::string& name) {
    bool relaxed = false;
    for (const MapperSettings& settings : mapper_ladder()) {
      ORBITFUSE_TRY(try_settings(level, name, settings));
      // Relaxed settings place views that are left out: what speaks against a model of all views is
      // none of that.
      if (selection_.has_best() || steps_.back().posed == total_) break;
      relaxed = true;
    }
    return selection_.has_best() && !relaxed ? Status{} : spared(try_global(level, name));
  }

  Status try_settings(FeatureLevel& level, const std::string& name,
                      const MapperSettings& settings) {
    const std::string attempt = fmt::format("COLMAP, {}, {}", name, settings.name);
    tell(2, attempt);
    ORBITFUSE_ASSIGN(Reconstruction model, level.map(settings, progress_));
    selection_.consider(attempt, level.found(), std::move(model), level);
    return progress_.check("poses.visible");
  }

  Status try_global(FeatureLevel& level, const std::string& name) {
    const std::string attempt = "global mapper, " + name;
    tell(2, attempt);
    ORBITFUSE_ASSIGN(FeatureGraph graph, level.graph());
    // Of matches that two views alone agree on, `sedan`'s relaxed model held .98, that of a walled
    // yard, with views on a wrong side, .89.
    constexpr double plainly_right = 0.95;
    if (selection_.has_best() &&
        held_matches(graph, posed_frames(graph, selection_.best())).share > plainly_right)
      return {};
    const Adjuster adjust = [&](Reconstruction model) -> Result<Reconstruction> {
      ORBITFUSE_ASSIGN(ModalityPoses poses,
                       adjust_model(std::move(model), session_, frames_, level.options()));
      return std::move(poses.reconstruction);
    };
    ORBITFUSE_ASSIGN(GlobalModel global, map_globally(graph, adjust, {}, progress_));
    // On the views of both: more views explain more matches, right or not.
    const Better explains_more = [&](const Reconstruction& model, const Reconstruction& best) {
      PosedFrames ours = posed_frames(graph, model), colmaps = posed_frames(graph, best);
      for (std::size_t f = 0; f < ours.poses.size(); ++f)
        if (!ours.poses[f] || !colmaps.poses[f]) ours.poses[f].reset(), colmaps.poses[f].reset();
      return model.views.size() >= best.views.size() &&
             explained_matches(graph, ours) > explained_matches(graph, colmaps);
    };
    selection_.consider(attempt, global.found, std::move(global.model), level, explains_more);
    return {};
  }

  /// The views left out, on the points of the best model, or of one that is too small to stand.
  Status try_resection(FeatureLevel& level, const std::string& attempt) {
    tell(3, attempt);
    ORBITFUSE_ASSIGN(FeatureGraph graph, level.graph());
    const Reconstruction& known = selection_.has_best() ? selection_.best() : *selection_.part();
    const auto without = total_ - static_cast<int>(known.views.size());
    PosedFrames posed = posed_frames(graph, known);
    add_confirmed(graph, rematched_
                             ? matches_along_own_lines(graph, posed)
                             : confirmed_matches(graph, posed, confirming_px * graph.pixel_scale));
    ORBITFUSE_ASSIGN(const std::vector<int> added, resect(graph, posed, {}, progress_));
    const std::string found = fmt::format("{} of {} views found a place", added.size(), without);
    Reconstruction model;
    if (!added.empty()) model = triangulated(graph, posed);
    selection_.consider(attempt, found, std::move(model), level);
    return {};
  }

  /// A model that was put together step by step has points of where its views stood then: where one
  /// was far off its true matches were outliers, and nothing that is left draws it back. They are
  /// triangulated again while that moves a view.
  Status try_all_matches() {
    constexpr int most_rounds = 4;
    ORBITFUSE_ASSIGN(const FeatureGraph graph, selection_.best_level().graph());
    const Reconstruction first = selection_.best();
    const Better draws_back = [&](const Reconstruction& model, const Reconstruction& before) {
      return explains_as_much(graph)(model, first) && farthest_move(model, before) > least_move;
    };
    bool moved = true;
    for (int round = 0; round < most_rounds && moved; ++round) {
      const std::string attempt =
          fmt::format("all matches triangulated again{}",
                      round == 0 ? "" : fmt::format(", round {}", round + 1));
      tell(3, attempt);
      Reconstruction model = triangulated_again(graph, selection_.best());
      ORBITFUSE_TRY(progress_.check("poses.visible"));
      const std::string found = fmt::format("{} points", model.points.size());
      moved = selection_.consider(attempt, found, std::move(model), selection_.best_level(),
                                  draws_back);
    }
    return {};
  }

  static Joint sure_joint(const Reconstruction& model) {
    return weakest_sure_joint(model, weakly_held(model));
  }
  static bool hangs_together(const Reconstruction& now, const Reconstruction& before) {
    return now.views.size() >= before.views.size() && sure_joint(before).loose() &&
           !sure_joint(now).loose();
  }
  static bool holds_more(const Reconstruction& now, const Reconstruction& before) {
    return ModelSelection::more_views(now, before) || hangs_together(now, before);
  }

  /// What is loose still when all matches have been made again: by more features.
  Status try_firmer_features() {
    if (asked_affine_ || !sure_joint(selection_.best()).loose()) return {};
    ORBITFUSE_TRY(try_affine_features(hangs_together));
    if (!affine_ || &selection_.best_level() != &*affine_) return {};
    rematched_ = false;
    ORBITFUSE_TRY(try_all_matches());
    return try_alignment();
  }

  /// Two parts of the best model that few points join, on the likeliest pairs across.
  Status try_joining() {
    const Reconstruction& best = selection_.best();
    const Joint joint = sure_joint(best);
    if (!joint.loose()) return {};
    const std::string attempt = "pairs across a loose joint";
    tell(1, "matches of the " + attempt);
    ORBITFUSE_ASSIGN(const FeatureGraph graph, selection_.best_level().graph());
    ORBITFUSE_ASSIGN(const std::vector<ViewPair> pairs,
                     likely_pairs_across(graph, best, joint, progress_));
    const std::string found = fmt::format(
        "{} points{}, {:.2f} of a view's, join {} views to the rest; {} pairs across look alike",
        joint.points, joint.views_of_point > 2 ? " of three views" : "", joint.share,
        joint.views_beyond, pairs.size());
    if (pairs.empty()) {
      selection_.note_fallen(attempt, found);
      return {};
    }
    ORBITFUSE_TRY(selection_.best_level().match(pairs, progress_));
    tell(2, "COLMAP, " + attempt);
    ORBITFUSE_ASSIGN(Reconstruction model, selection_.best_level().map({}, progress_));
    selection_.consider("COLMAP, " + attempt, found + "; " + selection_.best_level().found(),
                        std::move(model), selection_.best_level(), hangs_together);
    return {};
  }

  Status try_rematching() {
    tell(3, "matches along epipolar lines");
    ORBITFUSE_ASSIGN(const FeatureGraph graph, selection_.best_level().graph());
    RefinedTracks again = rematched_model(graph, selection_.best());
    ORBITFUSE_TRY(progress_.check("poses.visible"));
    adjust_rematched(std::move(again), graph);
    return {};
  }

  void adjust_rematched(RefinedTracks again, const FeatureGraph& graph) {
    const std::string attempt = "matched again along epipolar lines";
    if (again.model)
      rematched_ = selection_.consider(attempt, again.found, std::move(*again.model),
                                       selection_.best_level(), explains_as_much(graph));
    else if (!again.found.empty())
      selection_.note_fallen(attempt, again.found);
  }

  /// The best model on observations that the images themselves place, where that is most of them;
  /// else on the matches along its own epipolar lines.
  Status try_alignment() {
    const std::string attempt = "patches aligned";
    tell(3, attempt);
    ORBITFUSE_ASSIGN(const FeatureGraph graph, selection_.best_level().graph());
    RefinedTracks again = rematched_ ? RefinedTracks{} : rematched_model(graph, selection_.best());
    ORBITFUSE_ASSIGN(const bool held, try_alignment_of(again, attempt, graph));
    if (!held) adjust_rematched(std::move(again), graph);
    return {};
  }

  /// False where the model stays as it was. Errors: cancelled.
  Result<bool> try_alignment_of(const RefinedTracks& again, const std::string& attempt,
                                const FeatureGraph& graph) {
    FeatureLevel& level = selection_.best_level();
    const Reconstruction& start = again.model ? *again.model : selection_.best();
    const auto images = level.images(start);
    if (!images) {
      selection_.note_fallen(attempt, images.error().message());
      return false;
    }
    ORBITFUSE_ASSIGN(RefinedTracks aligned, aligned_model(start, *images, progress_));
    if (!again.found.empty()) aligned.found = again.found + "; " + aligned.found;
    if (!aligned.model) {
      selection_.note_fallen(attempt, aligned.found);
      return false;
    }
    const Better better = [&](const Reconstruction& model, const Reconstruction& before) {
      return explains_as_much(graph)(model, before) && holds_all_views(model);
    };
    return selection_.consider(again.model ? "matched again, " + attempt : attempt, aligned.found,
                               std::move(*aligned.model), level, better, aligned_bundle());
  }

  /// Pairs of the views left out, and of those next to them in the recording; while there is no
  /// model all of them, or the nearest of too many.
  std::vector<ViewPair> remaining_pairs() const {
    if (!selection_.has_best()) return nearest_pairs(frames_, most_pairs);
    std::set<int> wanted;
    for (const int f : missing())
      for (const int near : {f - 1, f, f + 1}) wanted.insert((near + total_) % total_);
    std::vector<ViewPair> pairs;
    for (const ViewPair& pair : exhaustive_pairs(total_))
      if (wanted.contains(pair.first) || wanted.contains(pair.second)) pairs.push_back(pair);
    return pairs;
  }

  Status try_more_pairs(FeatureLevel& level) {
    tell(1, "matches of the remaining pairs");
    ORBITFUSE_TRY(level.match(remaining_pairs(), progress_));
    return map_and_resect(level, "remaining pairs");
  }

  Status map_and_resect(FeatureLevel& level, const std::string& name,
                        const Better& better = ModelSelection::more_views) {
    if (!selection_.has_best()) {
      ORBITFUSE_TRY(try_mapper(level, name));
    } else {
      tell(2, "COLMAP, " + name);
      ORBITFUSE_ASSIGN(Reconstruction model, level.map({}, progress_));
      selection_.consider("COLMAP, " + name, level.found(), std::move(model), level, better);
    }
    if (!selection_.has_best() && selection_.part())
      return try_resection(level, "resection on part of a model, " + name);
    if (selection_.has_best() && !complete())
      ORBITFUSE_TRY(try_resection(level, "resection, COLMAP, " + name));
    return {};
  }

  /// As COLMAP would do by default, but for pairs of views that are posed already.
  Status try_full_settings() {
    if (!selection_.has_best() && total_ > max_exhaustive_views) return {};
    tell(0, "features at full settings");
    ORBITFUSE_ASSIGN(full_, FeatureLevel::extract(session_, frames_, at_full_settings(options_),
                                                  workdir_ / "full", progress_));
    std::vector<ViewPair> pairs = remaining_pairs();
    const std::vector<ViewPair> orbit = orbit_pairs(frames_);
    pairs.insert(pairs.end(), orbit.begin(), orbit.end());
    tell(1, "matches at full settings");
    ORBITFUSE_TRY(full_->match(pairs, progress_));
    return map_and_resect(*full_, "full settings");
  }

  /// What looks too different from one view to the next: patches are compared in the shapes that
  /// they have from each.
  Status try_affine_features(const Better& better) {
    asked_affine_ = true;
    if (total_ > max_exhaustive_views) {
      selection_.note_fallen("COLMAP, affine shapes",
                             fmt::format("not sought of {} views, {} at most: their pairs take too "
                                         "long",
                                         total_, max_exhaustive_views));
      return {};
    }
    // What stands without them isn't given up for a larger model of theirs that is contradicted.
    selection_.take_part();
    tell(0, "features of affine shapes");
    auto found =
        FeatureLevel::extract(session_, frames_, options_, workdir_ / "affine", progress_,
                              {.peak_threshold = faint_peak_threshold, .affine_shapes = true});
    if (!found && found.error().kind == ErrorKind::cancelled) return tl::unexpected(found.error());
    if (!found) {  // what the attempts before it say stands
      selection_.note_fallen("COLMAP, affine shapes", found.error().found);
      return {};
    }
    affine_ = *std::move(found);
    tell(1, "matches of affine shapes");
    ORBITFUSE_TRY(affine_->match(exhaustive_pairs(total_), progress_));
    ORBITFUSE_TRY(map_and_resect(*affine_, "affine shapes", better));
    // COLMAP's mapper leaves views out that the global one places.
    const bool asked = std::any_of(steps_.begin(), steps_.end(), [](const LadderStep& step) {
      return step.attempt == "global mapper, affine shapes";
    });
    return asked || !selection_.has_best() || complete() ? Status{}
                                                         : try_global(*affine_, "affine shapes");
  }

  Status doubt_placed_elsewhere(ModalityPoses& poses) const {
    ORBITFUSE_ASSIGN(const FeatureGraph graph, selection_.best_level().graph());
    ORBITFUSE_ASSIGN(const std::vector<DoubtfulView> elsewhere,
                     placed_elsewhere(graph, poses.reconstruction, progress_));
    for (const DoubtfulView& view : elsewhere) add_doubt(view, poses.doubtful);
    return {};
  }

  static void doubt_loose_part(ModalityPoses& poses) {
    const Joint joint = weakest_sure_joint(poses.reconstruction, poses.doubtful);
    doubt_beyond(joint, poses.reconstruction, poses.doubtful);
    // A loop that a false joint closes is bent all round.
    if (joint.loose())
      poses.warnings.push_back(fmt::format(
          "{} photos hang on the others by {} points{}: should these be mistaken, they may have "
          "bent the sure ones too; take photos between the doubtful ones and the rest",
          joint.views_beyond, joint.points,
          joint.views_of_point > 2 ? " that three photos see" : ""));
  }

  Result<ModalityPoses> answer() {
    if (!selection_.has_best()) {
      auto error = none_held(steps_, Modality::visible, workdir_);
      for (const std::string& file : featureless_)
        error.value().found += fmt::format("; {} {}", file, featureless_why);
      if (std::none_of(frames_.begin(), frames_.end(),
                       [](const FrameRecord* frame) { return frame->station.has_value(); }))
        error.value().remedy +=
            "; or say how far apart the views were taken, which tells like sides apart: import "
            "--station-spacing-deg";
      return error;
    }
    ModalityPoses& poses = selection_.settle();
    for (DroppedView& view : poses.dropped)
      if (featureless_.contains(view.name)) view.why = fmt::format("it {}", featureless_why);
    poses.doubtful = weakly_held(poses.reconstruction);
    if (poses.posed_ratio() < options_.min_posed_ratio)
      poses.warnings.push_back(fmt::format(
          "{} of {} photos have a place, {:.0f} % are asked for (poses.min_posed_ratio): the "
          "stations agree with these, and no attempt placed more",
          poses.reconstruction.views.size(), total_, 100 * options_.min_posed_ratio));
    ORBITFUSE_TRY(spared(doubt_placed_elsewhere(poses)));
    doubt_loose_part(poses);
    doubt_minority(poses.reconstruction, poses.doubtful);
    const auto all = static_cast<int>(exhaustive_pairs(total_).size()),
               pairs = selection_.best_level().pairs();
    if (pairs < all)
      poses.skips.push_back({"exhaustive matching", fmt::format("{} of {} pairs held", pairs, all),
                             fmt::format("{:.1f}x fewer pairs to match",
                                         static_cast<double>(all) / std::max(pairs, 1))});
    return std::move(poses);
  }

  const Session& session_;
  const std::vector<const FrameRecord*>& frames_;
  const PoseOptions& options_;
  const fs::path workdir_;
  const Progress& progress_;
  std::vector<LadderStep>& steps_;
  ModelSelection selection_;
  const int total_;
  std::string quick_name_ = "orbit pairs";
  std::set<std::string> featureless_;
  bool asked_affine_ = false;
  bool rematched_ = false;  ///< the best model's points are those along its epipolar lines
  bool limited_ = false;    ///< images were reduced or features cut off: full settings find others
  std::optional<FeatureLevel> faint_, full_, affine_;
};

}  // namespace

Result<ModalityPoses> pose_visible_views(const Session& session,
                                         const std::vector<const FrameRecord*>& frames,
                                         const PoseOptions& options, const fs::path& workdir,
                                         const Progress& progress, std::vector<LadderStep>& steps) {
  return VisibleLadder(session, frames, options, workdir, progress, steps).run();
}

}  // namespace orbitfuse
