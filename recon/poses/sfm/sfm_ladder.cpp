// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/sfm_ladder.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "core/system/file_io.hpp"
#include "recon/poses/frame_camera.hpp"
#include "recon/poses/sfm/bundle_adjustment.hpp"
#include "recon/poses/sfm/colmap.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// One choice of proxies and pairs; the mapper's settings are tried on each.
struct Attempt {
  std::string name;
  ProxyOptions proxies;
  double peak_threshold;
  bool exhaustive;
};

std::vector<Attempt> attempts(const PoseOptions& options, bool few_frames) {
  const double usual = 0.02 / 3;
  ProxyOptions local;
  local.max_side_px = options.max_image_side_px;
  local.clahe = local.destripe = true;
  std::vector<Attempt> list;
  list.push_back({"COLMAP, orbit pairs, local contrast", local, usual / 3, false});
  // Dim thermal pairs cost little to match (few features), so all pairs are affordable.
  if (!few_frames) list.push_back({"COLMAP, all pairs, local contrast", local, usual / 3, true});
  return list;
}

struct Lenses {
  std::vector<int> group;
  std::vector<LensGroup> lenses;
};

Lenses lens_groups(const Reconstruction& model, const Session& session) {
  std::map<std::string, const FrameRecord*> by_name;
  for (const FrameRecord& frame : session.frames) by_name[frame.file] = &frame;
  Lenses result;
  std::map<std::tuple<std::string, int, int>, int> index;
  for (const PosedView& view : model.views) {
    const auto found = by_name.find(view.name);
    const std::string device = found == by_name.end() ? "" : found->second->device;
    const auto [place, is_new] = index.try_emplace({device, view.camera.width, view.camera.height},
                                                   static_cast<int>(index.size()));
    result.group.push_back(place->second);
    if (!is_new) continue;
    LensGroup lens;
    const DeviceInfo* info = session.device(device);
    if (const auto calibrated =
            calibrated_camera(session, device, view.camera.width, view.camera.height)) {
      lens.focal_px = calibrated->fx;
      lens.refine_principal_point = lens.refine_distortion = false;
    } else if (info != nullptr && info->lens.focal_px) {
      lens.focal_px = *info->lens.focal_px;
      lens.focal_relative_sigma = info->lens.focal_relative_sigma;
    }
    // Self-calibration beyond the focal wants a well-covered orbit.
    if (model.views.size() < 10) lens.refine_principal_point = false;
    result.lenses.push_back(lens);
  }
  return result;
}

/// Views that COLMAP or the adjustment left out, each with a reason.
void name_dropped(const std::vector<const FrameRecord*>& frames,
                  const std::vector<std::string>& unsupported, ModalityPoses& poses) {
  std::set<std::string> posed;
  for (const PosedView& view : poses.reconstruction.views) posed.insert(view.name);
  const std::set<std::string> weak(unsupported.begin(), unsupported.end());
  for (const FrameRecord* frame : frames) {
    if (posed.contains(frame->file)) continue;
    poses.dropped.push_back({frame->file, weak.contains(frame->file)
                                              ? "too few observations agree with its pose"
                                              : "too few matches with the posed views"});
  }
}

/// The model of the other views.
Reconstruction without(const Reconstruction& model, const std::vector<std::string>& names) {
  Reconstruction rest;
  rest.modality = model.modality;
  std::vector<int> place;
  for (const PosedView& view : model.views) {
    const bool kept = std::find(names.begin(), names.end(), view.name) == names.end();
    place.push_back(kept ? static_cast<int>(rest.views.size()) : -1);
    if (kept) rest.views.push_back(view);
  }
  for (const SparsePoint& point : model.points) {
    SparsePoint kept = point;
    std::erase_if(kept.track, [&](const Observation& o) {
      return place[static_cast<std::size_t>(o.view)] < 0;
    });
    for (Observation& o : kept.track) o.view = place[static_cast<std::size_t>(o.view)];
    if (kept.track.size() >= 2) rest.points.push_back(std::move(kept));
  }
  return rest;
}

/// Views folded onto another side of a near-symmetric scene leave a model, and are named.
Status drop_folded(const Session& session, const std::vector<const FrameRecord*>& frames,
                   const PoseOptions& options, const BundleOptions& bundle, ModalityPoses& poses) {
  const std::size_t all = poses.reconstruction.views.size();
  std::set<std::string> folded;
  for (;;) {
    const std::optional<StationFit> fit = fit_stations(poses.reconstruction.views, session);
    if (!fit || fit->folded.empty()) break;
    folded.insert(fit->folded.begin(), fit->folded.end());
    if (static_cast<double>(folded.size()) > max_contradicting * static_cast<double>(all))
      return fail(ErrorKind::quality, "poses",
                  fmt::format("{} of {} views look from another side than their stations",
                              folded.size(), all),
                  "check the stations, or import without them");
    ORBITFUSE_ASSIGN(poses, adjust_model(without(poses.reconstruction, fit->folded), session,
                                         frames, options, bundle));
  }
  for (DroppedView& view : poses.dropped)
    if (folded.contains(view.name))
      view.why =
          "its matches place it on another side than its station, as one that looks alike "
          "would";
  return {};
}

}  // namespace

Result<ModalityPoses> adjust_model(Reconstruction model, const Session& session,
                                   const std::vector<const FrameRecord*>& frames,
                                   const PoseOptions& options, BundleOptions bundle) {
  const Lenses lenses = lens_groups(model, session);
  for (std::size_t v = 0; v < model.views.size(); ++v) {
    const LensGroup& lens = lenses.lenses[static_cast<std::size_t>(lenses.group[v])];
    const FrameRecord* frame = nullptr;
    for (const FrameRecord* f : frames)
      if (f->file == model.views[v].name) frame = f;
    Camera& camera = model.views[v].camera;
    if (frame != nullptr && lens.focal_px)
      camera =
          calibrated_camera(session, frame->device, camera.width, camera.height).value_or(camera);
  }
  // Errors scale with the pixels that features were found in, not with the recorded ones.
  const auto scale_of = [&](const Camera& camera) {
    return std::max(1.0, std::max(camera.width, camera.height) /
                             static_cast<double>(options.max_image_side_px));
  };
  double proxy_scale = 1;
  for (const PosedView& view : model.views)
    proxy_scale = std::max(proxy_scale, scale_of(view.camera));
  for (const PosedView& view : model.views)
    bundle.unit_px.push_back(scale_of(view.camera) / proxy_scale);
  bundle.loss_scale_px *= proxy_scale;
  bundle.max_error_px *= proxy_scale;
  ORBITFUSE_ASSIGN(const BundleReport report,
                   adjust_bundle(model, lenses.group, lenses.lenses, bundle));
  ModalityPoses poses;
  poses.frame_count = static_cast<int>(frames.size());
  poses.reprojection_rms_px = report.rms_px;
  poses.gates["reprojection_rms_proxy_px"] = report.rms_px / proxy_scale;
  poses.gates["median_triangulation_deg"] = report.median_triangulation_angle_deg;
  poses.gates["outlier_ratio"] =
      static_cast<double>(report.outliers) / std::max(report.outliers + report.observations, 1);
  poses.gates["bundle_converged"] = report.converged ? 1 : 0;
  for (const double sigma : report.focal_relative_sigma)
    if (std::isfinite(sigma))
      poses.gates["focal_sigma_percent"] =
          std::max(poses.gates["focal_sigma_percent"], 100 * sigma);
  for (const std::string& warning : report.warnings)
    poses.skips.push_back({"focal length from the images", warning, "the prior decides it"});
  poses.reconstruction = std::move(model);
  name_dropped(frames, report.dropped_views, poses);
  move_world(poses.reconstruction, canonical_from_world(poses.reconstruction.views, frames));
  return poses;
}

namespace {

/// The attempt that posed the most views; of several the first.
const LadderStep& nearest_of(const std::vector<LadderStep>& steps) {
  return *std::max_element(
      steps.begin(), steps.end(),
      [](const LadderStep& a, const LadderStep& b) { return a.posed < b.posed; });
}

std::string one_line(const LadderStep& step) {
  return fmt::format("{}: {}", step.attempt, step.why);
}

}  // namespace

tl::unexpected<Error> none_held(const std::vector<LadderStep>& steps, Modality modality,
                                const fs::path& workdir) {
  std::string found = one_line(nearest_of(steps));
  if (steps.size() > 1) {
    std::string list;
    for (const LadderStep& step : steps) list += one_line(step) + "\n";
    const bool listed = write_file_atomic(workdir / attempts_file, list).has_value();
    if (!listed) std::replace(list.begin(), list.end(), '\n', ';');
    found = fmt::format("none of {} attempts held ({}); the nearest, {}", steps.size(),
                        listed ? std::string("each of them: ") + attempts_file : list, found);
  }
  const bool beside_visible = std::any_of(steps.begin(), steps.end(), [](const LadderStep& step) {
    return step.attempt.starts_with("cross-modal");
  });
  return fail(ErrorKind::quality, fmt::format("poses.{}", name(modality)), found,
              modality == Modality::visible
                  ? "take sharp views every 10-15 deg with textured surroundings in sight, or "
                    "import known poses"
              : beside_visible
                  ? "record more thermal stations, with things in sight that stand on one side of "
                    "the object only, or import known poses"
                  : "record visible views of the same object too, or import known poses");
}

bool contradicted(const StationFit& fit, const PoseOptions& options) {
  // Chord of the median residual, in radii.
  const double residual = 2 * std::sin(fit.median_residual_deg / 2 * std::numbers::pi / 180.0);
  return !(residual <= options.max_station_residual &&
           fit.outliers <= max_contradicting * fit.views);
}

bool stations_contradict(const std::vector<PosedView>& views, const Session& session,
                         const PoseOptions& options) {
  const auto fit = fit_stations(views, session);
  return fit && contradicted(*fit, options);
}

std::optional<EvenSpacing> spacing_of(const std::vector<PosedView>& views, const Session& session) {
  auto even = even_spacing(views, session);
  const double most = max_contradicting * static_cast<double>(views.size());
  if (even && static_cast<double>(even->astray.size()) > most) return std::nullopt;
  return even;
}

bool passes_gates(ModalityPoses& poses, const Session& session, const PoseOptions& options,
                  std::string& why) {
  const auto posed = static_cast<int>(poses.reconstruction.views.size());
  poses.gates["posed_ratio"] = poses.posed_ratio();
  why = fmt::format("{}/{} views", posed, poses.frame_count);
  bool good = poses.posed_ratio() >= options.min_posed_ratio;
  if (!good)
    why += fmt::format(" (too few: {:.0f} % are asked for, poses.min_posed_ratio)",
                       100 * options.min_posed_ratio);

  const double rms = poses.gates["reprojection_rms_proxy_px"];
  why += fmt::format(", {:.2f} px, rays meet at {:.0f} deg", rms,
                     poses.gates["median_triangulation_deg"]);
  if (!(rms <= options.max_reprojection_rms_px)) {
    why += fmt::format(" (at most {:.2f} px are believed, poses.max_reprojection_rms_px)",
                       options.max_reprojection_rms_px);
    good = false;
  }

  if (const auto fit = fit_stations(poses.reconstruction.views, session)) {
    poses.gates["station_residual_deg"] = fit->median_residual_deg;
    poses.gates["station_outlier_ratio"] = static_cast<double>(fit->outliers) / fit->views;
    why += fmt::format(", {:.1f} deg from the stations in the median, {} of {} contradict them{}",
                       fit->median_residual_deg, fit->outliers, fit->views,
                       fit->mirrored ? " (which run the other way round)" : "");
    if (contradicted(*fit, options)) {
      why += fmt::format(
          " (believed are {:.0f} % of the radius, poses.max_station_residual, and "
          "{:.0f} % of the views)",
          100 * options.max_station_residual, 100 * max_contradicting);
      good = false;
    }
  }
  const CaptureOrder order = capture_order(poses.reconstruction.views, session);
  if (order.steps >= 8) {
    poses.gates["order_leaps"] = order.leaps;
    poses.gates["order_reversals"] = order.reversals;
    if (order.contradicted())
      why += fmt::format(", and leaps {} times or turns back {} times in {} steps of the recording",
                         order.leaps, order.reversals, order.steps);
    good = good && !order.contradicted();
  }
  return good;
}

Result<JudgedModel> judge_model(Reconstruction model, const Session& session,
                                const std::vector<const FrameRecord*>& frames,
                                const PoseOptions& options, BundleOptions bundle) {
  JudgedModel judged;
  ORBITFUSE_ASSIGN(judged.poses, adjust_model(std::move(model), session, frames, options, bundle));
  ORBITFUSE_TRY(drop_folded(session, frames, options, bundle, judged.poses));
  judged.believed = passes_gates(judged.poses, session, options, judged.why);
  return judged;
}

Result<ModalityPoses> structure_from_motion(const Session& session,
                                            const std::vector<const FrameRecord*>& frames,
                                            const PoseOptions& options, const fs::path& workdir,
                                            const Progress& progress,
                                            std::vector<LadderStep>& steps) {
  const Modality modality = frames.front()->modality;
  const std::string stage = fmt::format("poses.{}", name(modality));
  const int total = static_cast<int>(frames.size());
  for (const Attempt& attempt :
       attempts(options, orbit_pairs(frames).size() ==
                             exhaustive_pairs(static_cast<int>(frames.size())).size())) {
    const auto start = Clock::now();
    const fs::path folder = workdir / (attempt.exhaustive ? "all_pairs" : "orbit_pairs");
    const auto tell = [&](double done, const std::string& what) {
      progress.report({stage, done, 4, {}, attempt.name + ": " + what});
    };
    tell(0, "features");
    ORBITFUSE_ASSIGN(const std::vector<ProxyImage> images,
                     write_proxies(session, frames, attempt.proxies, folder / "images", progress));
    ColmapOptions engine{options.colmap, options.seed, options.max_features,
                         attempt.peak_threshold};
    ORBITFUSE_ASSIGN(ColmapProject project,
                     ColmapProject::create(folder / "colmap", folder / "images", engine));
    const Result<DatabaseCounts> features = project.extract(session, images, progress);
    if (!features && features.error().kind != ErrorKind::quality)
      return tl::unexpected(features.error());
    if (!features) {
      steps.push_back(
          {attempt.name, false, features.error().found, 0, total, seconds_since(start)});
      continue;
    }
    tell(1, "matches");
    const std::vector<ViewPair> pairs =
        attempt.exhaustive ? exhaustive_pairs(total) : orbit_pairs(frames);
    ORBITFUSE_ASSIGN(const DatabaseCounts matches, project.match(images, pairs, progress));
    const std::string found =
        fmt::format("{:.0f} features a view, {} of {} pairs verified", matches.mean_features,
                    matches.verified_pairs, matches.matched_pairs);

    auto attempt_start = start;
    for (const MapperSettings& settings : mapper_ladder()) {
      tell(2, "mapping, " + settings.name);
      ORBITFUSE_ASSIGN(Reconstruction model, project.map(session, images, settings, progress));
      LadderStep step{attempt.name + ", " + settings.name, false, found, 0, total, 0};
      if (model.views.size() >= 2) {
        tell(3, "bundle adjustment");
        Result<JudgedModel> judged = judge_model(std::move(model), session, frames, options);
        step.why += "; " + (judged ? judged->why : judged.error().found);
        if (judged) {
          step.held = judged->believed;
          step.posed = static_cast<int>(judged->poses.reconstruction.views.size());
        }
        step.seconds = seconds_since(attempt_start);
        steps.push_back(step);
        if (step.held) {
          if (!attempt.exhaustive && pairs.size() < exhaustive_pairs(total).size())
            judged->poses.skips.push_back(
                {"exhaustive matching",
                 fmt::format("{} of {} pairs held", pairs.size(), exhaustive_pairs(total).size()),
                 fmt::format("{:.1f}x fewer pairs to match",
                             static_cast<double>(exhaustive_pairs(total).size()) /
                                 static_cast<double>(pairs.size()))});
          return std::move(judged->poses);
        }
      } else {
        step.why += "; no model";
        step.seconds = seconds_since(attempt_start);
        steps.push_back(step);
      }
      attempt_start = Clock::now();
      ORBITFUSE_TRY(progress.check(stage));
    }
  }
  return none_held(steps, modality, workdir);
}

}  // namespace orbitfuse
