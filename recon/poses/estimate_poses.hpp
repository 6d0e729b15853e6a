// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/progress.hpp"
#include "core/result.hpp"
#include "core/session/session.hpp"
#include "recon/alignment/scene_renderer.hpp"
#include "recon/alignment/view_verdict.hpp"

// Camera poses of each modality by a ladder of methods, and the result says which attempt holds and
// why. Thermal views: the first whose result passes the gates. Visible views: of those that pass,
// the one that poses the most views (estimate/visible_ladder.hpp).
namespace orbitfuse {

struct PoseOptions {
  /// COLMAP's command; a bare name is looked up on PATH.
  std::string colmap = "colmap";
  /// Poses that the session already carries (transforms.json, ground truth) replace the stage.
  bool use_known_poses = true;
  /// They are held against the images first: poses of other images or of another lens would spoil
  /// all that follows without a word.
  bool check_known_poses = true;
  /// Thermal images that fit the visible scene better mirrored are refused: no other check would
  /// find that the heat is on the object's wrong side.
  bool check_mirrored = true;
  /// Thermal frames recorded between stations tie neighbouring stations together.
  bool use_tracking_frames = true;
  std::uint64_t seed = 1;
  /// Longest image side given to COLMAP. Features grow with the area and matching with their
  /// square; 800 px poses an orbit of 24 views to 0.03 % of its extent
  /// (docs/benchmarks/poses_visible.md).
  int max_image_side_px = 800;
  /// SIFT features per view, for the same reason.
  int max_features = 3000;
  /// Below this share of posed views an attempt does not hold and the next one is tried. Of photos
  /// seven tenths have to do where no attempt finds more and stations confirm them, unless more
  /// than the default are asked for.
  double min_posed_ratio = 0.8;
  /// Root mean square reprojection error above which a COLMAP model is not believed.
  double max_reprojection_rms_px = 2.0;
  /// A model whose camera centres leave the stations' orbit by more than this share of the orbit's
  /// radius (median) contradicts the capture and is not believed; it catches a merged front and
  /// back of a near-symmetric object.
  double max_station_residual = 0.25;

  /// Usage error naming the field.
  Status validate() const;
};

/// One method tried, and how it ended.
struct LadderStep {
  std::string attempt;  ///< "known poses", "COLMAP, default settings", "cross-modal", ...
  bool held = false;
  std::string why;  ///< figures behind the verdict, in words
  int posed = 0, total = 0;
  double seconds = 0;
  bool bettered = false;          ///< believed, and replaced by what a later attempt made
  bool against_stations = false;  ///< what spoke against the model was also its stations
};

/// A view without a supported pose, dropped rather than kept.
struct DroppedView {
  std::string name, why;
};

/// A view that is kept although something speaks against its pose: to be looked at.
struct DoubtfulView {
  std::string name;
  DoubtReason reason = DoubtReason::none;
  std::string why;
};

struct ModalityPoses {
  Reconstruction reconstruction;
  int frame_count = 0;  ///< views that could have been posed
  std::vector<DroppedView> dropped;
  std::vector<DoubtfulView> doubtful;  ///< among the posed ones
  std::vector<std::string> warnings;   ///< about more than one view
  std::vector<LadderStep> ladder;
  /// Root mean square over all observations; 0 where the attempt has none.
  double reprojection_rms_px = 0;
  /// Figures that need no ground truth, by name ("posed_ratio", "median_baseline_deg", ...).
  std::map<std::string, double> gates;
  std::vector<Skip> skips;

  double posed_ratio() const {
    return frame_count > 0 ? static_cast<double>(reconstruction.views.size()) / frame_count : 0.0;
  }
};

/// Thermal poses, with the frame they live in.
struct ThermalPoses : ModalityPoses {
  /// True: the world is the visible reconstruction's, registration has nothing left to find.
  /// False: a frame of its own, related to the visible one by an unknown similarity.
  bool shares_visible_frame = false;
};

/// The visible world that thermal views are localised in; images come from the session's paths.
struct VisibleScene {
  Reconstruction reconstruction;  ///< of the photos that its field learned from
  SceneRenderer renderer;  ///< of its trained field; without it only a rig places thermal views
  /// Of all posed photos, where these are more: a rig's thermal images stand beside them.
  std::optional<Reconstruction> posed = std::nullopt;
  /// Why posed photos are in doubt, by their names.
  std::map<std::string, std::string> doubts = {};
};

/// Visible views: known poses that the photos don't contradict, else COLMAP with orbit-limited
/// pairs and ever more relaxed settings, then bundle adjustment. World frame: z up, origin at the
/// point the cameras look at, median camera distance 1 (unless poses are known: then theirs).
/// `workdir`: a folder to write in, made where it isn't there; below it "visible" (thermal views:
/// "thermal") is written over, and holds reduced images, COLMAP's database, models and log
/// afterwards, of failures too. Nothing reads them again: the caller may remove them. Not touched
/// where neither structure from motion runs nor known poses are held against the photos.
/// Errors: usage (options), input (no or one frame, unreadable file), device (`workdir` can't be
/// written), unavailable (no COLMAP and no known poses), quality (no attempt held; the message
/// lists each attempt and why; or the photos contradict the known poses as a whole), cancelled.
Result<ModalityPoses> estimate_visible_poses(const Session& session, const PoseOptions& options,
                                             const std::filesystem::path& workdir,
                                             const Progress& progress);

/// Thermal views: known poses that `visible` (nullptr: none) doesn't contradict; else localisation
/// in it from the orbit prior of stations or order, or by its rig with the visible camera; else
/// COLMAP on the thermal views alone. Known poses that nothing can replace are in doubt. Errors as
/// above.
Result<ThermalPoses> estimate_thermal_poses(const Session& session, const VisibleScene* visible,
                                            const PoseOptions& options,
                                            const std::filesystem::path& workdir,
                                            const Progress& progress);

/// Whether estimate_thermal_poses() would ask `visible` for renders: to place thermal views, or to
/// hold known poses against them, which takes a known visible world and six views.
bool asks_for_renders(const Session& session, const PoseOptions& options);

/// How thermal frames are paired with photos that one device shot at once, as far as the answer of
/// estimate_thermal_poses() depends on it: "40 pairs by equal file names, declared"; "": no rig.
std::string described_rig(const Session& session);

/// The azimuths that the photos were declared with: where the photos contradict them, thermal
/// frames are posed in their order alone. "": they have no declared stations.
std::string declared_stations_of_photos(const Session& session);

}  // namespace orbitfuse
