// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate_poses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "recon/poses/cross_modal/cross_modal.hpp"
#include "recon/poses/known/scene_check.hpp"
#include "recon/poses/known/session_poses.hpp"
#include "recon/poses/rig/rig_poses.hpp"
#include "recon/poses/sfm/sfm_ladder.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {

namespace {

/// Whether thermal frames may be posed by their images alone, in a world of their own.
enum class WithoutPhotos { last, no };

/// From the images, but not as one rig; `steps` holds what was tried before.
Result<ThermalPoses> estimated_apart(const Session& session, const VisibleScene* visible,
                                     const PoseOptions& options,
                                     const std::filesystem::path& workdir, const Progress& progress,
                                     std::vector<LadderStep> steps, WithoutPhotos without) {
  const auto frames = session.frames_of(Modality::thermal, options.use_tracking_frames);
  if (visible != nullptr) {
    const std::size_t tried = steps.size();
    auto localised = localise_in_visible(session, *visible, frames, options, progress, steps);
    if (localised) {
      localised->ladder = std::move(steps);
      return localised;
    }
    if (localised.error().kind != ErrorKind::quality) return tl::unexpected(localised.error());
    if (steps.size() == tried)
      steps.push_back({"cross-modal, orbit prior", false, localised.error().found, 0,
                       static_cast<int>(frames.size()), 0});
    if (without == WithoutPhotos::no) return localised;
  }
  auto alone =
      structure_from_motion(session, frames, options, workdir / "thermal", progress, steps);
  if (!alone && visible != nullptr && alone.error().kind == ErrorKind::unavailable)
    alone.error().found =
        steps.back().attempt + ": " + steps.back().why + "; " + alone.error().found;
  if (!alone) return tl::unexpected(std::move(alone.error()));
  ModalityPoses poses = *std::move(alone);
  poses.ladder = std::move(steps);
  return ThermalPoses{std::move(poses), false};
}

/// From the images; `steps` holds what was tried before.
Result<ThermalPoses> estimated(const Session& session, const VisibleScene* visible,
                               const PoseOptions& options, const std::filesystem::path& workdir,
                               const Progress& progress, std::vector<LadderStep> steps,
                               WithoutPhotos without = WithoutPhotos::last) {
  const auto frames = session.frames_of(Modality::thermal, options.use_tracking_frames);
  if (frames.size() < 2)
    return fail(ErrorKind::input, session.folder.string(),
                fmt::format("{} thermal frames, at least 2 are needed", frames.size()),
                "record or import more views");
  const RigPairs rig = visible != nullptr ? find_rig_pairs(session) : RigPairs();
  if (rig.declared && rig.pairs.empty())
    steps.push_back({"rig", false,
                     "neither names nor times pair four fifths of the thermal frames with photos",
                     0, static_cast<int>(frames.size()), 0});
  if (!rig.pairs.empty()) {
    auto by_rig = pose_by_rig(session, visible->posed ? *visible->posed : visible->reconstruction,
                              rig, progress, steps);
    if (!by_rig && by_rig.error().kind != ErrorKind::quality) return by_rig;
    if (by_rig) {
      doubt_beside(visible->doubts, rig, *by_rig);
      by_rig->ladder = std::move(steps);
      return by_rig;
    }
  }
  const std::string no_rig = rig.declared && !steps.empty() ? steps.back().why : std::string();
  ORBITFUSE_ASSIGN(ThermalPoses poses, estimated_apart(session, visible, options, workdir, progress,
                                                       std::move(steps), without));
  if (!no_rig.empty())
    poses.warnings.push_back("the session says that its cameras are one rig, but " + no_rig +
                             ": the thermal frames were posed as if shot apart");
  return poses;
}

/// Who was wrong about the photos' stations was about these.
bool stations_doubtful(const Session& session, const VisibleScene* visible,
                       const PoseOptions& options) {
  return visible != nullptr &&
         have_declared_stations(session.frames_of(Modality::visible, false)) &&
         have_declared_stations(session.frames_of(Modality::thermal, false)) &&
         stations_contradict(visible->reconstruction.views, session, options);
}

/// What the posed photos' spacing is, where thermal frames were declared with the photos' own.
std::optional<double> spacing_by_photos(const Session& session, const VisibleScene& visible) {
  constexpr double alike = 1e-6;
  const auto photos = station_spacing_deg(session.frames_of(Modality::visible, false)),
             thermal = station_spacing_deg(session.frames_of(Modality::thermal, false));
  if (!photos || !thermal || !(std::abs(*photos - *thermal) < alike * *photos)) return std::nullopt;
  const auto even = spacing_of(visible.reconstruction.views, session);
  constexpr double least_deg = 1;  // a walk that goes round nothing has no loops
  return even && std::abs(even->spacing_deg) >= least_deg
             ? std::optional(std::abs(even->spacing_deg))
             : std::nullopt;
}

/// From the images, by the stations of the thermal frames; where the photos contradict these by the
/// photos' spacing, or at last in their order alone.
Result<ThermalPoses> from_images(const Session& session, const VisibleScene* visible,
                                 const PoseOptions& options, const std::filesystem::path& workdir,
                                 const Progress& progress, const std::vector<LadderStep>& steps) {
  if (!stations_doubtful(session, visible, options))
    return estimated(session, visible, options, workdir, progress, steps);
  const auto said = [](Result<ThermalPoses> poses, const std::string& used) {
    if (poses)
      poses->warnings.push_back(
          "the photos contradict the stations they were declared with: of the thermal frames " +
          used + " was used");
    return poses;
  };
  if (const auto spacing_deg = spacing_by_photos(session, *visible)) {
    // Thermal images alone, which know no spacing, come after the order.
    auto poses = estimated(at_spacing(session, Modality::thermal, *spacing_deg), visible, options,
                           workdir / "spacing", progress, steps, WithoutPhotos::no);
    if (poses || poses.error().kind != ErrorKind::quality)
      return said(std::move(poses),
                  fmt::format("the photos' own spacing, {:.4g} degrees,", *spacing_deg));
  }
  return said(estimated(in_order_alone(session, Modality::thermal), visible, options, workdir,
                        progress, steps),
              "the order alone");
}

/// Known thermal poses of a world that no photos' are of.
void tell_unchecked(bool photos_are_posed, ModalityPoses& known) {
  if (photos_are_posed)
    known.warnings.push_back(
        "nothing checks the known thermal poses: the photos' poses are not of their world; give "
        "the photos' as well, or let both be estimated: --set poses.use_known_poses=false");
  known.skips.push_back({"check of the known thermal poses",
                         photos_are_posed ? "no photos have known poses in the same world"
                                          : "there are no posed photos",
                         "taken as they are"});
}

/// Known poses that nothing confirms and nothing can replace.
ThermalPoses in_doubt(ModalityPoses known, const std::string& why) {
  for (const PosedView& view : known.reconstruction.views)
    known.doubtful.push_back(
        {view.name, DoubtReason::undecided, "nothing confirms its known pose"});
  known.ladder.push_back({"from the images", false, why, 0, known.frame_count, 0});
  return {std::move(known), true};
}

}  // namespace

Result<ThermalPoses> estimate_thermal_poses(const Session& session, const VisibleScene* visible,
                                            const PoseOptions& options,
                                            const std::filesystem::path& workdir,
                                            const Progress& progress) {
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_TRY(progress.check("poses.thermal"));
  if (!options.use_known_poses || !has_known_poses(session, Modality::thermal))
    return from_images(session, visible, options, workdir, progress, {});
  ORBITFUSE_ASSIGN(ModalityPoses known, known_poses(session, Modality::thermal));
  // Known poses of a session share one world; estimated visible ones do not live in it.
  const bool shares = visible != nullptr && has_known_poses(session, Modality::visible);
  if (!shares && options.check_known_poses) tell_unchecked(visible != nullptr, known);
  if (!shares || !options.check_known_poses) return ThermalPoses{std::move(known), shares};
  ORBITFUSE_ASSIGN(const std::optional<Contradiction> contradiction,
                   check_by_scene(session, *visible, progress, known));
  if (!contradiction) return ThermalPoses{std::move(known), shares};
  LadderStep step = known.ladder.back();
  step.held = false, step.why = contradiction->words;
  Result<ThermalPoses> poses =
      from_images(without_known_poses(session, Modality::thermal, contradiction->true_focal),
                  visible, options, workdir, progress, {step});
  if (!poses && poses.error().kind == ErrorKind::cancelled) return poses;
  // An answer in a world of its own is worth less than poses that may be right in this one.
  const bool found = poses && poses->shares_visible_frame;
  const std::string why = found   ? ""
                          : poses ? "but in a world of their own"
                                  : poses.error().where + ": " + poses.error().found;
  if (!found) poses = in_doubt(std::move(known), why);
  poses->warnings.insert(
      poses->warnings.begin(),
      fmt::format(
          "the visible scene doesn't confirm the known thermal poses{}: {}; correct them, or "
          "set poses.check_known_poses = false to take them as they are",
          found ? ", which were estimated from the images instead"
                : fmt::format(", and the images alone place no views ({}): they are all in doubt",
                              why),
          contradiction->words));
  return poses;
}

bool asks_for_renders(const Session& session, const PoseOptions& options) {
  if (!options.use_known_poses || !has_known_poses(session, Modality::thermal)) return true;
  const auto frames = session.frames_of(Modality::thermal);
  const auto posed = std::count_if(frames.begin(), frames.end(), [](const FrameRecord* frame) {
    return frame->cam_from_world.has_value();
  });
  return options.check_known_poses && has_known_poses(session, Modality::visible) &&
         static_cast<std::size_t>(posed) >= least_views_to_judge;
}

std::string declared_stations_of_photos(const Session& session) {
  const auto photos = session.frames_of(Modality::visible, false);
  if (!have_declared_stations(photos)) return {};
  std::string declared;
  for (const FrameRecord* photo : photos)
    declared += fmt::format("{:g} ", photo->station->azimuth_deg);
  return declared;
}

std::string described_rig(const Session& session) {
  const RigPairs rig = find_rig_pairs(session);
  if (rig.pairs.empty()) return {};
  return fmt::format("{} pairs by {}{}", rig.pairs.size(), rig.found_by,
                     rig.declared ? ", declared" : "");
}

}  // namespace orbitfuse
