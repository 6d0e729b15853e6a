// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/poses/estimate_poses.hpp"
#include "recon/poses/sfm/bundle_adjustment.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {

/// Structure from motion of thermal views, step by step: orbit-limited pairs with the mapper's
/// default, then relaxed settings, exhaustive pairs last. Each model goes through bundle adjustment
/// and the gates; the first that passes holds. (Visible views: estimate/visible_ladder.hpp.)
/// The ladder of a failure is in `steps` as well as in the error's message.
/// Errors: input, unavailable (no COLMAP), quality (no attempt held), cancelled.
Result<ModalityPoses> structure_from_motion(const Session& session,
                                            const std::vector<const FrameRecord*>& frames,
                                            const PoseOptions& options,
                                            const std::filesystem::path& workdir,
                                            const Progress& progress,
                                            std::vector<LadderStep>& steps);

/// A model that structure from motion made, and whether the gates believe it.
struct JudgedModel {
  ModalityPoses poses;  ///< after bundle adjustment, in the canonical world
  bool believed = false;
  std::string why;  ///< the figures behind the verdict
};

/// Bundle adjustment with the session's lenses, in the canonical world; `bundle` is in pixels of
/// the images that features were found in. Errors: those of adjust_bundle.
Result<ModalityPoses> adjust_model(Reconstruction model, const Session& session,
                                   const std::vector<const FrameRecord*>& frames,
                                   const PoseOptions& options, BundleOptions bundle = {});

/// How the ladder judges each model, which may come from elsewhere too: adjusted, without
/// the views that it folded onto another side than their stations', then the gates. `frames` are
/// all that could have been posed. Errors: those of adjust_bundle; quality (too many folded).
Result<JudgedModel> judge_model(Reconstruction model, const Session& session,
                                const std::vector<const FrameRecord*>& frames,
                                const PoseOptions& options, BundleOptions bundle = {});

/// All attempts of a ladder that failed, a line each, in its work folder.
constexpr const char* attempts_file = "attempts.txt";

/// The error of a ladder of which no attempt held, by the one that posed the most views; all of
/// them are listed in `attempts_file`. `steps`: at least one.
tl::unexpected<Error> none_held(const std::vector<LadderStep>& steps, Modality modality,
                                const std::filesystem::path& workdir);

/// Share of the views that may contradict their stations; beyond, the model is refused as a whole.
inline constexpr double max_contradicting = 0.15;

/// More views lie beside their stations, or farther from them, than is believed.
bool contradicted(const StationFit& fit, const PoseOptions& options);
/// Whether the stations that views have contradict them; false where too few have one.
bool stations_contradict(const std::vector<PosedView>& views, const Session& session,
                         const PoseOptions& options);
/// The even spacing of all but so few of the views; nothing where no spacing explains the model.
std::optional<EvenSpacing> spacing_of(const std::vector<PosedView>& views, const Session& session);

/// The gates a model must pass without ground truth; `why` says the figures either way.
/// Fills poses.gates.
bool passes_gates(ModalityPoses& poses, const Session& session, const PoseOptions& options,
                  std::string& why);

}  // namespace orbitfuse
