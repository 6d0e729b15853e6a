// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <charconv>
#include <set>

#include "app/cli/option_pairs.hpp"
#include "app/cli/run_folder.hpp"
#include "app/cli/run_stages.hpp"
#include "app/cli/typed_options.hpp"
#include "app/cli/verb.hpp"
#include "app/export/dataset.hpp"
#include "app/export/find_scale.hpp"
#include "app/export/mat_scale.hpp"
#include "app/export/surface_files.hpp"
#include "app/pipeline/out_folder.hpp"
#include "app/pipeline/stage_record.hpp"
#include "app/verbs/measure_options.hpp"

namespace orbitfuse::cli {
namespace {
namespace fs = std::filesystem;
using namespace exporting;

struct ExportArguments {
  std::string out, crop_box, up, colors = "visible", palette, flavour = "plain";
  std::string dataset, poses = "recorded", mat, pose_error;
  std::vector<std::string> files, distance;
  bool whole = false, points = false, known_poses = false, without_ground = false;
  std::optional<int> triangles, mat_tags;
  std::optional<double> ground_clearance;
};

Result<std::vector<double>> numbers(const char* option, const std::string& word, std::size_t count,
                                    const char* form) {
  std::vector<double> values;
  const char* at = word.data();
  const char* const end = at + word.size();
  while (values.size() < count) {
    double value = 0;
    const auto [stop, error] = std::from_chars(at, end, value);
    const bool last = values.size() + 1 == count;
    if (error != std::errc() || !std::isfinite(value) ||
        (last ? stop != end : stop == end || *stop != ','))
      return fail(ErrorKind::usage, option, "'" + word + "'", std::string("write ") + form);
    values.push_back(value);
    at = stop + (last ? 0 : 1);
  }
  return values;
}

Result<SurfaceRequest> request_of(const ExportArguments& o) {
  SurfaceRequest request;
  if (o.triangles) request.surface.surface.triangles = *o.triangles;
  if (o.whole) request.crop = Crop::whole;
  request.surface.surface.without_ground = o.without_ground;
  if (o.ground_clearance) request.surface.surface.ground_clearance = *o.ground_clearance;
  if (!o.crop_box.empty()) {
    ORBITFUSE_ASSIGN(const auto v,
                     numbers("--crop-box", o.crop_box, 6,
                             "CX,CY,CZ,SX,SY,SZ: middle and sides, in the run's unit"));
    request.crop = Crop::box;
    const Eigen::Vector3d center(v[0], v[1], v[2]), half(v[3] / 2, v[4] / 2, v[5] / 2);
    if (!(half.minCoeff() > 0))
      return fail(ErrorKind::usage, "--crop-box", "'" + o.crop_box + "', with a side of 0 or less",
                  "give three sides above 0");
    request.box = {center - half, center + half};
  }
  if (const Status valid = request.surface.validate(); !valid)
    return tl::unexpected(
        as_typed(valid.error(), {{"surface.triangles", "--triangles"},
                                 {"surface.ground_clearance", "--ground-clearance"}}));
  return request;
}

Result<FileOptions> file_options(const ExportArguments& o, const view::FinishedRun& run,
                                 const SurfaceRequest& request) {
  FileOptions files;
  files.made_of = surface_key(run, request);
  files.points = o.points;
  if (o.colors == "temperature") files.colors = VertexColors::temperature;
  files.palette = o.palette.empty() ? run.config.render.palette : o.palette;
  if (const auto known = palette(files.palette); !known)
    return tl::unexpected(as_typed(known.error(), {{"palette", "--palette"}}));
  if (o.flavour == "cloudcompare") files.temperature_name = "scalar_temperature";
  if (o.flavour == "meshlab") files.temperature_name = "quality";
  return files;
}

/// The name of one of the run's new views, of more than a hundred too.
bool is_new_view(const std::string& out, const std::string& word) {
  std::error_code ignored;
  return names_new_view(word) ||
         (word.find_first_not_of("0123456789") == std::string::npos &&
          fs::exists(fs::path(out) / "render/depth" / (word + ".tiff"), ignored));
}

/// VIEW,U,V or X,Y,Z: the first word decides.
Result<measurement::Place> place_of(const std::string& out, const std::string& word) {
  constexpr const char* form = "write VIEW,U,V (a pixel of a recorded view) or X,Y,Z";
  double first = 0;
  const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), first);
  const std::size_t comma = word.find(',');
  if (comma == std::string::npos || comma == 0)
    return fail(ErrorKind::usage, "--distance", "'" + word + "'", form);
  if (is_new_view(out, word.substr(0, comma)))
    return fail(ErrorKind::usage, "--distance", "'" + word + "', a pixel of a rendered view",
                "point at one of a recorded view, e.g. visible/000003.jpg,320,240");
  if (error == std::errc() && stop == word.data() + comma) {
    ORBITFUSE_ASSIGN(const auto v, numbers("--distance", word, 3, "X,Y,Z or VIEW,U,V"));
    return Eigen::Vector3d(v[0], v[1], v[2]);
  }
  ORBITFUSE_ASSIGN(const auto v,
                   numbers("--distance", word.substr(comma + 1), 2, "VIEW,U,V or X,Y,Z"));
  return measurement::PixelPlace{word.substr(0, comma), {v[0], v[1]}};
}

/// The scale that was told now, which stays with the run, or the one that the run has.
Result<std::optional<stages::MetricScale>> scale_of(Context& context, const ExportArguments& o,
                                                    const view::FinishedRun& run) {
  const int told = !o.distance.empty() + !o.mat.empty() + o.known_poses;
  if (told > 1)
    return fail(ErrorKind::usage, "--distance, --mat or --known-poses", "more than one of them",
                "tell the scale in one way");
  if (told == 0) return stages::scale_of_run(o.out);
  ORBITFUSE_ASSIGN(const std::string world, stages::world_identity(o.out));
  const auto found = [&]() -> Result<stages::MetricScale> {
    if (o.known_poses) {
      std::optional<double> place_error_m;
      if (!o.pose_error.empty()) {
        ORBITFUSE_ASSIGN(place_error_m, metres_of("--pose-error", o.pose_error));
      }
      return scale_of_known_poses(run, place_error_m);
    }
    if (!o.mat.empty()) {
      MatDesign design;
      ORBITFUSE_ASSIGN(design.size_m, metres_of("--mat", o.mat));
      design.tags_per_side = o.mat_tags.value_or(design.tags_per_side);
      return scale_of_mat(run, design, context.progress).map_error([](Error error) {
        return as_typed(std::move(error),
                        {{"mat.size_m", "--mat"}, {"mat.tags_per_side", "--mat-tags"}});
      });
    }
    ORBITFUSE_ASSIGN(const measurement::Place from, place_of(o.out, o.distance.at(0)));
    ORBITFUSE_ASSIGN(const measurement::Place to, place_of(o.out, o.distance.at(1)));
    ORBITFUSE_ASSIGN(const double metres, metres_of("--distance", o.distance.at(2)));
    return scale_of_distance(run, from, to, metres, context.progress);
  };
  ORBITFUSE_ASSIGN(const stages::MetricScale scale, found());
  if (scale.relative_uncertainty > 0.05)
    context.console.warning(fmt::format("the scale is sure to {} only: tell a longer distance",
                                        stages::uncertainty_words(scale)));
  if (!context.common.dry_run) ORBITFUSE_TRY(stages::save_metric_scale(o.out, world, scale));
  context.result["scale"] = stages::to_json(scale);
  context.console.info(fmt::format("1 unit is {:.5f} m +- {}: {}, {}", scale.metres_per_unit,
                                   stages::uncertainty_words(scale), scale.source, scale.how));
  return scale;
}

Status export_dataset(Context& context, const ExportArguments& o, const view::FinishedRun& run,
                      const ExportFrame& frame) {
  DatasetOptions options;
  options.path = context.config.render.path;
  if (o.poses == "new") options.poses = DatasetPoses::fresh;
  ORBITFUSE_ASSIGN(const PairSet pairs,
                   write_dataset(o.dataset, run, frame, options, context.progress));
  context.result["dataset"] = {{"folder", o.dataset}, {"pairs", pairs.pairs}};
  context.console.data(o.dataset);
  context.console.info(fmt::format("{} pairs: {}", pairs.pairs, pairs.described));
  return {};
}

Status export_surface(Context& context, const std::vector<fs::path>& files,
                      const view::FinishedRun& run, const SurfaceRequest& request,
                      const ExportFrame& frame, const FileOptions& how) {
  ORBITFUSE_ASSIGN(const FieldSurface surface, surface_of_run(run, request, context.progress));
  context.result["vertices"] = surface.mesh.vertices.size();
  context.result["triangles"] = surface.mesh.triangles.size();
  context.result["vertices_without_temperature"] = surface.without_temperature;
  if (request.surface.surface.without_ground) {
    context.result["ground_left_out"] = surface.ground.has_value();
    if (!surface.ground)
      context.console.warning(
          "no ground was found, and nothing left out: the object hangs free, or what it stands on "
          "ends within the box or is not level; --crop-box cuts by hand");
  }
  const auto asked = static_cast<std::size_t>(request.surface.surface.triangles);
  if (surface.mesh.triangles.size() > asked)
    context.console.warning(
        fmt::format("{} triangles were asked for, {} are left: the simplifier goes no further",
                    asked, surface.mesh.triangles.size()));
  context.result["files"] = nlohmann::json::array();
  for (const fs::path& file : files) {
    ORBITFUSE_TRY(write_surface(file, run, surface, frame, how));
    context.result["files"].push_back(file.string());
    context.console.data(file.string());
  }
  context.console.info(
      fmt::format("{}{} vertices, {} of them without {}",
                  how.points ? "" : fmt::format("{} triangles, ", surface.mesh.triangles.size()),
                  surface.mesh.vertices.size(), surface.without_temperature,
                  run.thermal_is_gray ? "infrared level" : "temperature"));
  return {};
}

Status check_outside_stages(const fs::path& out, const char* option, const fs::path& target) {
  if (!pipeline::lies_in_a_stage(out, target)) return {};
  return fail(ErrorKind::usage, option, "'" + target.string() + "', inside of a stage of the run",
              "write it elsewhere, e.g. to " + (out / "export").string());
}

/// What would be found only after the surface was made.
Status check_target(const fs::path& out, const fs::path& file, bool force) {
  ORBITFUSE_TRY(check_extension(file));
  std::error_code unreadable;
  if (fs::is_directory(file, unreadable))
    return fail(ErrorKind::usage, "--to", "'" + file.string() + "', which is a folder",
                "name a file");
  ORBITFUSE_TRY(check_outside_stages(out, "--to", file));
  for (const fs::path& made : {file, fs::path(file.string() + ".json")})
    ORBITFUSE_TRY(pipeline::check_out_file(made));
  if (force || !holds_other_work(file)) return {};
  return fail(ErrorKind::usage, "--to",
              "'" + file.string() + "', where something is that no finished export left there",
              "name another file, or write over it and its .json: --force");
}

/// Likewise of all targets together.
Status check_targets(const ExportArguments& o, const std::vector<fs::path>& files, bool force) {
  std::error_code unreadable;
  std::set<fs::path> seen;
  const fs::path dataset =
      fs::weakly_canonical(fs::absolute(o.dataset, unreadable), unreadable) / "";
  for (const fs::path& file : files) {
    ORBITFUSE_TRY(check_target(o.out, file, force));
    const fs::path whole = fs::weakly_canonical(fs::absolute(file, unreadable), unreadable);
    if (!seen.insert(whole).second)
      return fail(ErrorKind::usage, "--to", "'" + file.string() + "' twice", "name each file once");
    if (!o.dataset.empty() && whole.string().starts_with(dataset.string()))
      return fail(ErrorKind::usage, "--to",
                  "'" + file.string() + "', inside of the new folder of --dataset",
                  "write it beside that folder");
  }
  if (o.dataset.empty()) return {};
  ORBITFUSE_TRY(check_outside_stages(o.out, "--dataset", o.dataset));
  return check_dataset_folder(o.dataset);
}

/// What lies among a session's frames would be taken for one of them.
Status check_outside_frames(const ExportArguments& o, const view::FinishedRun& run,
                            const std::vector<fs::path>& files) {
  if (!run.session) return {};
  const auto check = [&](const char* option, const fs::path& target) -> Status {
    if (!lies_among_frames(target, run.session->folder)) return {};
    return fail(ErrorKind::usage, option,
                "'" + target.string() + "', among the frames of the session", "write it elsewhere");
  };
  for (const fs::path& file : files) ORBITFUSE_TRY(check("--to", file));
  return o.dataset.empty() ? Status{} : check("--dataset", o.dataset);
}

/// Options that another one would have passed over in silence.
Status check_pairs(const ExportArguments& o) {
  const bool surface = o.dataset.empty() || !o.files.empty();
  const bool ply = std::any_of(o.files.begin(), o.files.end(), [](const std::string& file) {
    return extension_of(file) == ".ply";
  });
  ORBITFUSE_TRY(check_apart({{"--whole", o.whole, "--crop-box", !o.crop_box.empty()}}));
  return check_needs({
      {"--ground-clearance", o.ground_clearance.has_value(), "--without-ground", o.without_ground},
      {"--mat-tags", o.mat_tags.has_value(), "--mat", !o.mat.empty()},
      {"--pose-error", !o.pose_error.empty(), "--known-poses", o.known_poses},
      {"--palette", !o.palette.empty(), "--colors temperature", o.colors == "temperature"},
      {"--flavour", o.flavour != "plain", "a PLY file to write (--to)", ply},
      {"--points", o.points, "a PLY file to write (--to)", ply},
      {"--poses", o.poses != "recorded", "--dataset", !o.dataset.empty()},
      {"--triangles", o.triangles.has_value(), "--to beside --dataset", surface},
      {"--crop-box", !o.crop_box.empty(), "--to beside --dataset", surface},
      {"--whole", o.whole, "--to beside --dataset", surface},
      {"--without-ground", o.without_ground, "--to beside --dataset", surface},
      {"--colors", o.colors != "visible", "--to beside --dataset", surface},
  });
}

Status run(Context& context, const ExportArguments& o) {
  ORBITFUSE_TRY(check_pairs(o));
  std::vector<fs::path> files(o.files.begin(), o.files.end());
  if (files.empty() && o.dataset.empty()) files.push_back(fs::path(o.out) / default_surface_file);
  ORBITFUSE_TRY(check_targets(o, files, context.common.force));
  ORBITFUSE_ASSIGN(const SurfaceRequest request, request_of(o));
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  if (!o.up.empty()) {
    ORBITFUSE_ASSIGN(const auto v, numbers("--up", o.up, 3, "X,Y,Z, e.g. 0,0,1"));
    up = {v[0], v[1], v[2]};
    if (!(up.norm() > 0))
      return fail(ErrorKind::usage, "--up", "'" + o.up + "', which is no direction",
                  "write X,Y,Z, e.g. 0,0,1");
  }
  ORBITFUSE_ASSIGN(const view::FinishedRun run,
                   view::load_finished_run(o.out, context.config, context.progress));
  ORBITFUSE_TRY(check_outside_frames(o, run, files));
  ORBITFUSE_ASSIGN(const FileOptions how, file_options(o, run, request));
  for (const std::string& note : run.notes) context.console.warning(note);
  ORBITFUSE_ASSIGN(const auto scale, scale_of(context, o, run));
  ORBITFUSE_ASSIGN(const ExportFrame frame, export_frame(up, scale));
  context.result["unit"] = frame.unit();
  context.console.info(frame.words());
  if (context.common.dry_run) {
    context.console.info("the run can be exported");
    return {};
  }
  if (!files.empty()) ORBITFUSE_TRY(export_surface(context, files, run, request, frame, how));
  if (!o.dataset.empty()) return export_dataset(context, o, run, frame);
  return {};
}

}  // namespace

Action add_export(CLI::App& app) {
  const auto o = std::make_shared<ExportArguments>();
  app.add_option("out", o->out, "The --out folder of a finished run")->required();
  app.add_option("--to", o->files,
                 "File to write, .glb, .ply, .obj or .las; may be given again (default: "
                 "OUT/export/surface.glb)");
  app.add_option("--triangles", o->triangles, "Most triangles of the surface (default 200000)");
  app.add_option("--crop-box", o->crop_box,
                 "CX,CY,CZ,SX,SY,SZ: export this box of the run's world, in its unit, instead of "
                 "what the cameras look at");
  app.add_flag("--whole", o->whole, "Export what lies round the object too");
  app.add_flag("--without-ground", o->without_ground,
               "Leave out the ground that the object stands on, where there is one");
  app.add_option("--ground-clearance", o->ground_clearance,
                 "How far above the ground the object begins, as a share of the box's longest side "
                 "(default 0.005, more on rough ground)");
  app.add_option("--up", o->up, "X,Y,Z of the run's world that becomes the files' up");
  app.add_option("--colors", o->colors, "Of the vertices: as seen, or a palette's of temperature")
      ->check(CLI::IsMember({"visible", "temperature"}));
  app.add_option("--palette", o->palette, "With --colors temperature (default: render.palette)");
  app.add_option("--flavour", o->flavour,
                 "What PLY calls the temperature: temperature, scalar_temperature, quality")
      ->check(CLI::IsMember({"plain", "cloudcompare", "meshlab"}));
  app.add_flag("--points", o->points, "PLY: points without triangles");
  app.add_option("--distance", o->distance,
                 "A B LENGTH: two places, each VIEW,U,V or X,Y,Z, and how far apart they are, e.g. "
                 "1.20m; kept in OUT/scale.json")
      ->expected(3);
  app.add_option(
      "--mat", o->mat,
      "Side of the printed mat in the visible views, e.g. 0.6m: the scale is read from it");
  app.add_option("--mat-tags", o->mat_tags, "Tags along a side of the mat, if not the default");
  app.add_flag("--known-poses", o->known_poses,
               "The poses that the session came with are in metres: the scale is theirs");
  app.add_option("--pose-error", o->pose_error,
                 "How far off the place of a known pose may be along each axis (standard "
                 "deviation), e.g. 5mm; needed where the run took the poses as they are");
  app.add_option("--dataset", o->dataset,
                 "New folder for aligned visible and thermal pairs, to train other methods");
  app.add_option("--poses", o->poses, "Of the pairs: the visible photos' or new ones (render.*)")
      ->check(CLI::IsMember({"recorded", "new"}));
  return [o](Context& context) { return run(context, *o); };
}

}  // namespace orbitfuse::cli
