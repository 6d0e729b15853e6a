// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate_poses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/geometry/level_cameras.hpp"
#include "recon/poses/estimate/visible_ladder.hpp"
#include "recon/poses/known/photo_check.hpp"
#include "recon/poses/known/session_poses.hpp"
#include "recon/poses/sfm/sfm_ladder.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {
namespace {

/// Which side the cameras lay on nothing says for sure.
void tell_side(ModalityPoses& poses) {
  const std::vector<Rigid3d> cameras = cameras_of(poses.reconstruction.views);
  if (held_on_side(cameras)) {
    poses.warnings.push_back(
        "the photos lie on their side: up is taken to be where their cameras stand above what they "
        "look at; if new views are upside down, turn the photos upright and import them again");
    return;
  }
  constexpr double usual_share = 0.2;  // single ones don't change what is up
  const double share = share_not_upright(cameras, up_direction(cameras));
  if (share > usual_share)
    poses.warnings.push_back(fmt::format(
        "the photos don't agree which way is up: {:.0f} % of them would lie on their side or "
        "upside down; if new views are tilted, turn the photos upright and import them again",
        100 * share));
}

/// A spacing that was declared wrongly contradicts every model that is right: none is believed, or
/// most views are missing. Then the photos are posed in the order they were taken in alone, which a
/// model must keep, and which counts where another even spacing explains it.
Result<ModalityPoses> pose_by_photos(const Session& session, const PoseOptions& options,
                                     const std::filesystem::path& workdir, const Progress& progress,
                                     std::vector<LadderStep>& steps) {
  const auto frames = session.frames_of(Modality::visible, options.use_tracking_frames);
  if (frames.size() < 2)
    return fail(ErrorKind::input, session.folder.string(),
                fmt::format("{} visible frames, at least 2 are needed", frames.size()),
                "record or import more views");
  auto poses = pose_visible_views(session, frames, options, workdir / "visible", progress, steps);
  if (poses || poses.error().kind != ErrorKind::quality || !have_declared_stations(frames) ||
      std::none_of(steps.begin(), steps.end(),
                   [](const LadderStep& step) { return step.against_stations; }))
    return poses;
  const Session ordered = in_order_alone(session, Modality::visible);
  const std::size_t before = steps.size();
  auto anew =
      pose_visible_views(ordered, ordered.frames_of(Modality::visible, options.use_tracking_frames),
                         options, workdir / "visible_in_order", progress, steps);
  if (!anew && anew.error().kind != ErrorKind::quality) return anew;
  for (std::size_t i = before; i < steps.size(); ++i) steps[i].attempt += ", in order alone";
  std::optional<EvenSpacing> spacing;
  if (anew) {
    const std::vector<PosedView>& views = anew->reconstruction.views;
    const auto fit = fit_stations(views, session);
    if (fit && contradicted(*fit, options))
      spacing = spacing_of(views, session);
    else if (fit && fit->folded.empty())
      return anew;  // a model of the declared stations, after all
  }
  if (!spacing) {
    for (std::size_t i = before; i < steps.size(); ++i) {
      if (steps[i].held) steps[i].why += "; no other even spacing explains it";
      steps[i].held = false;
    }
    poses.error().remedy +=
        "; are the stations right (--station-spacing-deg, --loops)? The order of the photos alone, "
        "with any other even spacing, gave no model either";
    return poses;
  }
  for (const std::string& name : spacing->astray)
    if (std::none_of(anew->doubtful.begin(), anew->doubtful.end(),
                     [&](const DoubtfulView& known) { return known.name == name; }))
      anew->doubtful.push_back({name, DoubtReason::off_its_loop,
                                "it stands aside of where the even spacing of the others has it"});
  anew->warnings.push_back(fmt::format(
      "the photos contradict the stations they were declared with: they are posed in their order "
      "alone, {0:.4g} degrees apart; import with --station-spacing-deg {0:.4g}, or without "
      "stations",
      std::abs(spacing->spacing_deg)));
  return anew;
}

}  // namespace

Result<ModalityPoses> estimate_visible_poses(const Session& session, const PoseOptions& options,
                                             const std::filesystem::path& workdir,
                                             const Progress& progress) {
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_TRY(progress.check("poses.visible"));
  if (options.use_known_poses && has_known_poses(session, Modality::visible)) {
    ORBITFUSE_ASSIGN(ModalityPoses known, known_poses(session, Modality::visible));
    if (options.check_known_poses)
      ORBITFUSE_TRY(check_by_photos(session, options, workdir / "visible", progress, known));
    tell_side(known);
    return known;
  }
  std::vector<LadderStep> steps;
  ORBITFUSE_ASSIGN(ModalityPoses poses, pose_by_photos(session, options, workdir, progress, steps));
  poses.ladder = std::move(steps);
  tell_side(poses);
  return poses;
}

}  // namespace orbitfuse
