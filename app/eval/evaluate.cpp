// SPDX-License-Identifier: BSD-3-Clause
#include "app/eval/evaluate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>

#include "app/eval/doubts.hpp"
#include "app/eval/image_error.hpp"
#include "app/pipeline/stage_record.hpp"
#include "app/stages/artifacts.hpp"
#include "app/stages/recorded_detail.hpp"
#include "app/stages/rendered_views.hpp"
#include "app/stages/session_input.hpp"
#include "app/stages/stage_list.hpp"
#include "core/geometry/narrowed.hpp"
#include "core/geometry/pose_error.hpp"
#include "core/temperature.hpp"
#include "recon/assembly/training_data.hpp"
#include "recon/nerf/nerf.hpp"

namespace orbitfuse::eval {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using stages::DetailedField;

/// The name the truth may know a frame by: its original file, else its place in the session.
std::string base_name(const FrameRecord& frame) {
  return fs::path(frame.source.empty() ? frame.file : frame.source).filename().string();
}

/// The truth of one modality's station frames by their names; null where several share a name, in
/// the session or in the truth: no pose is better than another one's.
using KnownViews = std::map<std::string, const TrueView*>;

KnownViews known_views(const Session& session, Modality modality,
                       const std::vector<TrueView>& truth) {
  KnownViews known;
  for (const TrueView& view : truth) {
    const auto [at, fresh] = known.try_emplace(fs::path(view.name).filename().string(), &view);
    if (!fresh) at->second = nullptr;
  }
  std::set<std::string> names;
  for (const FrameRecord* frame : session.frames_of(modality, false)) {
    const auto at = known.find(base_name(*frame));
    if (!names.insert(base_name(*frame)).second && at != known.end()) at->second = nullptr;
  }
  return known;
}

/// Pairs of estimated and true poses of one modality's station frames.
std::vector<PosePair> match(const Session& session, const Reconstruction& model,
                            const KnownViews& truth) {
  std::vector<PosePair> pairs;
  for (const FrameRecord* frame : session.frames_of(model.modality, false)) {
    const auto posed = std::find_if(model.views.begin(), model.views.end(),
                                    [&](const PosedView& v) { return v.name == frame->file; });
    const auto known = truth.find(base_name(*frame));
    if (posed != model.views.end() && known != truth.end() && known->second != nullptr)
      pairs.push_back({posed->cam_from_world, known->second->cam_from_world});
  }
  return pairs;
}

json to_json(const PoseError& e, std::size_t total) {
  return {{"posed", e.views},
          {"total", total},
          {"ate_percent", e.ate_percent},
          {"ate_max_percent", e.ate_max_percent},
          {"rotation_mean_deg", e.rotation_mean_deg},
          {"rotation_median_deg", e.rotation_median_deg},
          {"rotation_max_deg", e.rotation_max_deg}};
}

/// What a finished run left, loaded as far as it is there.
struct Run {
  fs::path out;
  json result = json::object();
  std::optional<Similarity3d> truth_from_visible, truth_from_thermal;
  Similarity3d visible_from_thermal;
  bool registered = false;

  bool done(const std::string& stage) const {
    return fs::exists(out / stage / pipeline::stage_record_file);
  }
  void note(const std::string& text) { result["notes"].push_back(text); }
  void warn(const std::string& text) { result["warnings"].push_back(text); }
};

Status add_poses(Run& run, const Session& session, const GroundTruth& truth, Modality modality,
                 std::vector<PosePair>& pairs) {
  const std::string stage = "poses_" + std::string(name(modality));
  const auto views = truth.views.find(modality);
  if (!run.done(stage) || views == truth.views.end()) {
    run.note(fmt::format("{} is not finished, or the truth has no such views", stage));
    return {};
  }
  ORBITFUSE_ASSIGN(const Reconstruction model, stages::load_poses(run.out / stage, modality));
  const KnownViews known = known_views(session, modality, views->second);
  for (const auto& [file, view] : known)
    if (view == nullptr)
      run.note(fmt::format("{}: {} is there more than once, and left out", stage, file));
  pairs = match(session, model, known);
  const auto fit = truth_from_estimate(pairs);
  if (!fit) {
    run.note(stage + ": " + fit.error().message());
    return {};
  }
  const PoseError error = pose_error(pairs, *fit);
  run.result[stage] = to_json(error, views->second.size());
  auto& truth_from_estimated =
      modality == Modality::visible ? run.truth_from_visible : run.truth_from_thermal;
  truth_from_estimated = *fit;
  // What the run doubts itself must not decide where its fields lie.
  ORBITFUSE_ASSIGN(const auto doubts, stages::load_doubts(run.out / stage));
  Reconstruction sure = model;
  std::erase_if(sure.views, [&](const PosedView& view) { return doubts.contains(view.name); });
  const std::vector<PosePair> sure_pairs = match(session, sure, known);
  const auto sure_fit = truth_from_estimate(sure_pairs);
  const bool told_apart = sure_fit && 2 * sure_pairs.size() >= pairs.size();
  const PoseError sure_error = told_apart ? pose_error(sure_pairs, *sure_fit) : error;
  if (told_apart && sure_pairs.size() < pairs.size()) {
    run.result[stage]["sure"] = to_json(sure_error, views->second.size());
    truth_from_estimated = *sure_fit;
  }
  if (const auto doubt = doubt_of_truth(told_apart ? sure_pairs : pairs, sure_error))
    run.warn(stage + ": " + *doubt);
  return {};
}

/// Thermal cameras in the visible frame: the error of the registration as a user meets it.
/// Also as training left them (poses refined against the field).
Status add_registration(Run& run, const Session& session, const GroundTruth& truth,
                        const std::vector<PosePair>& thermal) {
  if (!run.done("register")) {
    run.note("register is not finished: no registration to measure");
    return {};
  }
  if (!run.truth_from_visible || !run.truth_from_thermal) {
    run.note("the registration is measured where both modalities' poses are");
    return {};
  }
  ORBITFUSE_ASSIGN(const stages::RegistrationRecord record,
                   stages::load_registration(run.out / "register"));
  run.visible_from_thermal = record.visible_from_thermal;
  run.registered = true;
  const Similarity3d truth_from_thermal = *run.truth_from_visible * run.visible_from_thermal;
  const Similarity3d error = run.truth_from_thermal->inverse() * truth_from_thermal;
  json result = to_json(pose_error(thermal, truth_from_thermal), thermal.size());
  result["similarity_rotation_deg"] =
      rotation_angle_deg(error.rotation, Eigen::Quaterniond::Identity());
  result["similarity_scale_percent"] = 100 * std::abs(error.scale - 1);
  run.result["registration"] = result;
  const fs::path trained = run.out / "train_thermal";
  if (!run.done("train_thermal") || !fs::exists(trained / "model")) return {};
  ORBITFUSE_ASSIGN(const Reconstruction model, stages::load_poses(trained, Modality::thermal));
  const std::vector<PosePair> refined = match(
      session, model, known_views(session, Modality::thermal, truth.views.at(Modality::thermal)));
  run.result["registration_refined"] =
      to_json(pose_error(refined, truth_from_thermal), thermal.size());
  return {};
}

struct Sums {
  double visible_psnr = 0, mae_k = 0, thermal_psnr = 0, covered = 0;
  int visible = 0, thermal = 0;
  LevelPairs levels;  ///< of a field of gray levels
};

/// A true view's image at the size of a camera narrowed from its own; of other proportions than
/// that one it is another camera's.
Result<cv::Mat> true_image(const fs::path& file, Samples samples, const Camera& own,
                           const Camera& camera) {
  ORBITFUSE_ASSIGN(cv::Mat image, field_image(file, samples));
  const double skew = std::abs(static_cast<double>(image.cols) * own.height -
                               static_cast<double>(image.rows) * own.width);
  if (skew > std::max(own.width, own.height))
    return fail(ErrorKind::input, file.string(),
                fmt::format("{}x{} pixels", image.cols, image.rows),
                fmt::format("test.K of the truth is for {}x{}: give those of one camera", own.width,
                            own.height));
  if (image.cols == camera.width && image.rows == camera.height) return image;
  cv::Mat result;
  cv::resize(image, result, {camera.width, camera.height}, 0, 0, cv::INTER_AREA);
  return result;
}

/// As the run's new views show it. Empty where the run has no such field.
Result<DetailedField> load_shown(const Run& run, const Session& session, Modality modality,
                                 int width_px) {
  DetailedField shown;
  const std::string train = "train_" + std::string(name(modality));
  if (!run.done(train)) return shown;
  ORBITFUSE_ASSIGN(shown.field, nerf::Field::load(run.out / train / stages::field_file));
  ORBITFUSE_ASSIGN(shown.detail, stages::detail_of_new_views(stages::context_of_run(run.out),
                                                             session, modality, width_px));
  return shown;
}

Status compare_visible(DetailedField& shown, const TrueTestView& view, const Camera& camera,
                       const Rigid3d& cam_from_visible, const Progress& progress, Sums& sums) {
  ORBITFUSE_ASSIGN(const nerf::RenderedView seen,
                   shown.render(camera, cam_from_visible, {}, progress));
  ORBITFUSE_ASSIGN(const cv::Mat truth,
                   true_image(view.visible, Samples::color, view.camera, camera));
  cv::Mat truth8, seen8;
  truth.convertTo(truth8, CV_8U, 255);
  seen.color.convertTo(seen8, CV_8U, 255);
  sums.visible_psnr += psnr_db(seen8, truth8, 255);
  ++sums.visible;
  return {};
}

Status compare_thermal(DetailedField& shown, const TrueTestView& view, const Camera& camera,
                       const Rigid3d& cam_from_thermal, Samples samples,
                       const EvaluateOptions& options, const Progress& progress, Sums& sums) {
  ORBITFUSE_ASSIGN(nerf::RenderedView seen, shown.render(camera, cam_from_thermal, {}, progress));
  ORBITFUSE_ASSIGN(const cv::Mat truth,
                   true_image(view.thermal, Samples::kelvin, view.camera, camera));
  seen.color.setTo(std::nanf(""), seen.opacity < options.min_opacity);
  const double scene_above_k = kelvin_from_celsius(options.scene_above_c);
  if (samples == Samples::gray) {
    sums.levels.add(seen.color, truth, scene_above_k);
    return {};
  }
  const ThermalViewError error = thermal_view_error(seen.color, truth, scene_above_k);
  if (!std::isfinite(error.mae_k)) return {};
  sums.mae_k += error.mae_k;
  sums.covered += error.covered;
  sums.thermal_psnr += error.psnr_db;
  ++sums.thermal;
  return {};
}

Status add_test_views(Run& run, const Session& session, const GroundTruth& truth,
                      const EvaluateOptions& options, const Progress& progress) {
  if (!run.truth_from_visible || truth.test.empty()) return {};
  int widest = 0;
  for (const TrueTestView& view : truth.test) widest = std::max(widest, view.camera.width);
  const int detail_width = stages::detail_width_px(std::min(options.max_width_px, widest));
  ORBITFUSE_ASSIGN(DetailedField visible,
                   load_shown(run, session, Modality::visible, detail_width));
  DetailedField thermal;
  if (run.registered) {
    ORBITFUSE_ASSIGN(thermal, load_shown(run, session, Modality::thermal, detail_width));
  }
  Sums sums;
  for (std::size_t i = 0; i < truth.test.size(); ++i) {
    const TrueTestView& view = truth.test[i];
    progress.report(
        {"eval", static_cast<double>(i), static_cast<double>(truth.test.size()), {}, ""});
    const Camera camera = narrowed_to(view.camera, options.max_width_px);
    const Rigid3d cam_from_visible = rebase(view.cam_from_world, run.truth_from_visible->inverse());
    if (!visible.empty() && !view.visible.empty())
      ORBITFUSE_TRY(compare_visible(visible, view, camera, cam_from_visible, progress, sums));
    if (!thermal.empty() && !view.thermal.empty())
      ORBITFUSE_TRY(compare_thermal(
          thermal, view, camera, rebase(cam_from_visible, run.visible_from_thermal.inverse()),
          stages::samples_of(session, Modality::thermal), options, progress, sums));
  }
  json result = {{"views", truth.test.size()}};
  if (sums.visible > 0) {
    const double psnr_db = sums.visible_psnr / sums.visible;
    result["visible_psnr_db"] = psnr_db;
    const auto trained = stages::load_trained_frames(run.out / "train_visible");
    if (trained)
      if (const auto doubt = doubt_of_test_views(psnr_db, trained->heldout_psnr_db))
        run.warn(*doubt);
  }
  if (sums.thermal > 0) {
    result["temperature_mae_c"] = sums.mae_k / sums.thermal;
    result["thermal_psnr_db"] = sums.thermal_psnr / sums.thermal;
    result["thermal_covered"] = sums.covered / sums.thermal;
  }
  if (sums.levels.scene > 0) {
    const LevelError error = level_error(sums.levels);
    result["thermal_covered"] = error.covered;
    if (std::isfinite(error.rank_correlation)) {
      result["gray_rank_correlation"] = error.rank_correlation;
      result["gray_mae_c"] = error.mae_k;
    }
  }
  run.result["test_views"] = result;
  return {};
}

}  // namespace

Result<json> evaluate(const fs::path& out, const Session& session, const GroundTruth& truth,
                      const EvaluateOptions& options, const Progress& progress) {
  Run run;
  run.out = out;
  run.result["notes"] = run.result["warnings"] = json::array();
  std::vector<PosePair> visible, thermal;
  ORBITFUSE_TRY(add_poses(run, session, truth, Modality::visible, visible));
  ORBITFUSE_TRY(add_poses(run, session, truth, Modality::thermal, thermal));
  ORBITFUSE_TRY(add_registration(run, session, truth, thermal));
  ORBITFUSE_TRY(add_test_views(run, session, truth, options, progress));
  json seconds = json::object();
  for (const auto& entry : fs::directory_iterator(out)) {
    if (!fs::exists(entry.path() / pipeline::stage_record_file)) continue;
    const auto record = pipeline::read_stage_record(entry.path());
    if (record) seconds[record->stage] = {{"wall_s", record->wall_s}, {"cpu_s", record->cpu_s}};
  }
  run.result["time"] = seconds;
  return run.result;
}

}  // namespace orbitfuse::eval
