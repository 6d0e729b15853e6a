// SPDX-License-Identifier: BSD-3-Clause
#include "app/export/dataset.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "app/pipeline/out_folder.hpp"
#include "app/stages/artifacts.hpp"
#include "app/stages/learned_views.hpp"
#include "app/stages/recorded_detail.hpp"
#include "core/formats/colmap_model.hpp"
#include "core/formats/transforms_json.hpp"
#include "core/image/image_io.hpp"
#include "core/image/undistorted.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::exporting {
namespace {
namespace fs = std::filesystem;

/// Splatting starts from points; more than this many only slow it down.
constexpr std::size_t most_points = 100'000;

Result<cv::Mat> photo(const view::FinishedRun& run, const PosedView& view) {
  ORBITFUSE_ASSIGN(const cv::Mat image, read_visible(run.session->folder / view.name));
  return recorded_straight(image, view.camera, view.name);
}

/// What the recorded frames add to pictures of the fields, as in the run's own new views.
struct RunDetail {
  nerf::PhotoDetail visible, thermal;
};

Result<RunDetail> detail_of(const view::FinishedRun& run, DatasetPoses poses,
                            const std::vector<PosedView>& views) {
  RunDetail detail;
  if (!run.session) return detail;
  int widest = 0;
  for (const PosedView& view : views) widest = std::max(widest, view.camera.width);
  const pipeline::StageContext context = stages::context_of_run(run.out);
  const auto load = [&](Modality modality) {
    return stages::detail_of_new_views(context, *run.session, modality,
                                       stages::detail_width_px(widest));
  };
  if (poses == DatasetPoses::fresh) {
    ORBITFUSE_ASSIGN(detail.visible, load(Modality::visible));
  }
  ORBITFUSE_ASSIGN(detail.thermal, load(Modality::thermal));
  return detail;
}

Result<cv::Mat> rendered_color(const view::FinishedRun& run, RunDetail& detail,
                               const PosedView& view, const Progress& progress) {
  ORBITFUSE_ASSIGN(nerf::RenderedView seen,
                   nerf::render(run.visible, view.camera, view.cam_from_world, {}, progress));
  ORBITFUSE_TRY(detail.visible.add(run.visible, view.camera, view.cam_from_world, seen, progress));
  cv::Mat bgr;
  cv::cvtColor(seen.color, bgr, cv::COLOR_RGB2BGR);
  bgr.convertTo(bgr, CV_8UC3, 255);
  return bgr;
}

Result<cv::Mat> rendered_kelvin(const view::FinishedRun& run, RunDetail& detail,
                                const PosedView& view, const Progress& progress) {
  const Rigid3d cam_from_thermal = rebase(view.cam_from_world, run.frame_from_thermal.inverse());
  ORBITFUSE_ASSIGN(nerf::RenderedView seen,
                   nerf::render(run.thermal, view.camera, cam_from_thermal, {}, progress));
  ORBITFUSE_TRY(detail.thermal.add(run.thermal, view.camera, cam_from_thermal, seen, progress));
  seen.color.setTo(std::numeric_limits<float>::quiet_NaN(),
                   seen.opacity < run.config.render.min_opacity);
  return seen.color;
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

struct Cameras {
  std::vector<PosedView> views;  ///< in the run's world
  std::string described;
};

/// Of photos in doubt those are left out that the field did not learn from: their pairs would be
/// rendered from where they were not taken.
Result<Cameras> cameras_of(const view::FinishedRun& run, const DatasetOptions& options) {
  Cameras cameras;
  ORBITFUSE_ASSIGN(const stages::LearnedViews learned,
                   stages::learned_views(stages::context_of_run(run.out), Modality::visible));
  std::size_t doubtful = 0;
  for (const view::RecordedView& v : run.views) {
    if (v.modality != Modality::visible || contains(learned.left_out, v.view.name)) continue;
    cameras.views.push_back(v.view);
    doubtful += v.doubt ? 1 : 0;
  }
  std::string doubts;
  if (!learned.left_out.empty())
    doubts += fmt::format(", {} left out whose poses are in doubt", learned.left_out.size());
  if (doubtful > 0) doubts += fmt::format(", the poses of {} of them in doubt", doubtful);
  if (options.poses == DatasetPoses::recorded) {
    if (!run.session)
      return fail(ErrorKind::input, "dataset", "the session is not where the run read it",
                  "bring it back, or take new poses: --poses new");
    cameras.described = fmt::format("{} recorded views{}", cameras.views.size(), doubts);
    return cameras;
  }
  ORBITFUSE_ASSIGN(NewViews fresh, new_views(cameras.views, options.path));
  return Cameras{std::move(fresh.views), std::move(fresh.described)};
}

/// 8-bit levels between the bounds, 0 where nothing was measured.
cv::Mat levels_of(const cv::Mat& kelvin, TemperatureSpan span) {
  cv::Mat levels, known = kelvin == kelvin;
  cv::Mat scaled = (kelvin - span.low_k) * (255 / (span.high_k - span.low_k));
  scaled.setTo(0, ~known);
  scaled.convertTo(levels, CV_8U);
  return levels;
}

Status write_model(const fs::path& folder, const view::FinishedRun& run, const ExportFrame& frame,
                   const Transforms& transforms) {
  Reconstruction model;
  for (const TransformsFrame& f : transforms.frames)
    model.views.push_back({fs::path(f.file_path).filename().string(), f.camera, f.cam_from_world});
  for (std::size_t i = 0; i < std::min(run.surface.size(), most_points); ++i) {
    SparsePoint point;
    point.position = frame.export_from_world * run.surface.positions[i];
    if (!run.surface.colors.empty()) point.rgb = run.surface.colors[i];
    model.points.push_back(std::move(point));
  }
  return write_colmap_model(folder / "sparse" / "0", model, ColmapFormat::binary);
}

Status write_pairs(const fs::path& folder, const view::FinishedRun& run, const ExportFrame& frame,
                   const DatasetOptions& options, const Cameras& cameras,
                   const Progress& progress) {
  ORBITFUSE_ASSIGN(RunDetail detail, detail_of(run, options.poses, cameras.views));
  Transforms transforms;
  std::vector<cv::Mat> kelvin;
  for (const PosedView& posed : cameras.views) {
    ORBITFUSE_TRY(progress.check("dataset"));
    progress.report({"dataset",
                     static_cast<double>(kelvin.size()),
                     static_cast<double>(cameras.views.size()),
                     {},
                     posed.name});
    PosedView view = posed;
    view.camera = posed.camera.without_distortion();
    const std::string file = fmt::format("{:06}.png", kelvin.size());
    ORBITFUSE_ASSIGN(const cv::Mat image, options.poses == DatasetPoses::recorded
                                              ? photo(run, posed)
                                              : rendered_color(run, detail, view, progress));
    ORBITFUSE_TRY(write_png(folder / "images" / file, image));
    ORBITFUSE_ASSIGN(cv::Mat seen, rendered_kelvin(run, detail, view, progress));
    kelvin.push_back(std::move(seen));
    transforms.frames.push_back({"images/" + file, "thermal/" + file, view.camera,
                                 rebase(view.cam_from_world, frame.export_from_world)});
  }
  // The bounds hold every temperature: what lies outside would be lost to who trains on levels.
  const TemperatureSpan span = common_span(kelvin, 0, 100);
  const double kelvin_per_count = kelvin_per_count_for(kelvin);
  for (std::size_t i = 0; i < kelvin.size(); ++i) {
    const std::string name = fmt::format("{:06}", i);
    ORBITFUSE_TRY(write_png(folder / "thermal" / (name + ".png"), levels_of(kelvin[i], span)));
    if (!run.thermal_is_gray)
      ORBITFUSE_TRY(write_thermal_tiff(folder / "thermal_kelvin" / (name + ".tiff"), kelvin[i],
                                       kelvin_per_count));
  }
  if (!run.thermal_is_gray)
    ORBITFUSE_TRY(stages::save_temperature_bounds(folder, span.low_k, span.high_k));
  ORBITFUSE_TRY(write_transforms_json(folder / "transforms.json", transforms));
  ORBITFUSE_TRY(write_model(folder, run, frame, transforms));
  const auto words = [](const char* field, const nerf::PhotoDetail& lent) {
    return fmt::format("rendered by the {} field{}", field,
                       lent.empty() ? "" : ", with detail of the recorded frames");
  };
  nlohmann::json about = to_json(frame);
  about["schema"] = 1;
  about["pairs"] = kelvin.size();
  about["cameras"] = cameras.described;
  about["visible"] = options.poses == DatasetPoses::recorded ? "photos without distortion"
                                                             : words("visible", detail.visible);
  about["thermal"] = words("thermal", detail.thermal);
  return stages::write_json(folder / "dataset.json", about);
}

/// A new folder beside the one to be written: a name that is there already is somebody's own.
Result<fs::path> make_beside(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(fs::absolute(folder, error).parent_path(), error);
  for (int n = 0; !error; ++n) {
    fs::path partial = fmt::format("{}.partial-{}-{}", folder.string(), ::getpid(), n);
    if (fs::create_directory(partial, error)) return partial;
  }
  return fail(ErrorKind::device, folder.string(), error.message(), "see who may write there");
}

}  // namespace

Status check_dataset_folder(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder, error) &&
      !(fs::is_directory(folder, error) && fs::is_empty(folder, error)))
    return fail(ErrorKind::usage, "--dataset", "'" + folder.string() + "' is there already",
                "choose a new folder");
  ORBITFUSE_TRY(pipeline::check_out_folder(folder));
  // It is written beside the folder first.
  const fs::path whole = fs::absolute(folder, error) / "";
  return pipeline::check_out_folder(whole.parent_path().parent_path());
}

Result<PairSet> write_dataset(const fs::path& given, const view::FinishedRun& run,
                              const ExportFrame& frame, const DatasetOptions& options,
                              const Progress& progress) {
  ORBITFUSE_TRY(check_dataset_folder(given));
  // Written beside it first, which "pairs/" would put inside.
  const fs::path folder = given.has_filename() ? given : given.parent_path();
  std::error_code error;
  if (!run.has(Modality::visible) || !run.has(Modality::thermal))
    return fail(ErrorKind::input, run.out.string(), "not both fields",
                "pairs need a visible and a thermal orbit that are registered");
  ORBITFUSE_ASSIGN(const Cameras cameras, cameras_of(run, options));
  ORBITFUSE_ASSIGN(const fs::path partial, make_beside(folder));
  if (const Status written = write_pairs(partial, run, frame, options, cameras, progress);
      !written) {
    fs::remove_all(partial, error);
    return tl::unexpected(written.error());
  }
  fs::remove(folder, error);  // empty, or not there
  fs::rename(partial, folder, error);
  if (error) {
    std::error_code left;
    fs::remove_all(partial, left);
    return fail(ErrorKind::device, folder.string(), error.message(), "see who may write there");
  }
  return PairSet{cameras.views.size(), cameras.described};
}

}  // namespace orbitfuse::exporting
