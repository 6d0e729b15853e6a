// SPDX-License-Identifier: BSD-3-Clause
#include "app/export/surface_files.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "app/export/glb.hpp"
#include "app/stages/artifacts.hpp"
#include "core/formats/las.hpp"
#include "core/formats/obj.hpp"
#include "core/formats/ply.hpp"
#include "core/image/palette.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::exporting {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;

/// Times the reach of the object: all that the cameras surround and what lies not far behind it.
constexpr double whole_share = 2 / 0.6;

Result<Eigen::AlignedBox3d> box_of(const SurfaceRequest& request,
                                   const std::vector<PosedView>& cameras) {
  if (request.crop == Crop::box) return request.box;
  auto box = object_box(cameras);
  if (!box)
    return fail(box.error().kind, box.error().where, box.error().found,
                "say which part is wanted: --crop-box");
  if (request.crop == Crop::object) return box;
  const Eigen::Vector3d center = box->center(), half = whole_share / 2 * box->sizes();
  return Eigen::AlignedBox3d(center - half, center + half);
}

/// As --crop-box takes it.
std::string words_of(const Eigen::AlignedBox3d& box) {
  const Eigen::Vector3d c = box.center(), s = box.sizes();
  return fmt::format("{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g}", c.x(), c.y(), c.z(), s.x(), s.y(),
                     s.z());
}

/// Palette colours for temperatures, gray where there is none.
Status paint_temperatures(const view::FinishedRun& run, const std::string& name,
                          PointCloud& vertices) {
  if (vertices.temperatures_k.empty())
    return fail(ErrorKind::usage, "--colors", "temperature, of which the run has none",
                "choose visible");
  ORBITFUSE_ASSIGN(const cv::Mat colors, palette(name));
  const cv::Mat kelvin(vertices.temperatures_k, false);
  const cv::Mat painted = colorize(kelvin, run.span, colors);
  vertices.colors.assign(vertices.size(), {128, 128, 128});
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (!std::isfinite(vertices.temperatures_k[i])) continue;
    const auto& bgr = painted.at<cv::Vec3b>(static_cast<int>(i), 0);
    vertices.colors[i] = {bgr[2], bgr[1], bgr[0]};
  }
  return {};
}

json sidecar(const view::FinishedRun& run, const FieldSurface& surface, const TriangleMesh& mesh,
             const ExportFrame& frame, FileAxes axes, const FileOptions& options) {
  json j = to_json(frame, axes);
  j["schema"] = 2;  // 1: `up` of the frame, z of every file
  if (!options.made_of.empty()) j["made_of"] = options.made_of;
  j["run"] = fs::absolute(run.out).lexically_normal().string();
  j["vertices"] = mesh.vertices.size();
  j["triangles"] = mesh.triangles.size();
  j["fused_triangles"] = surface.fused_triangles;
  if (surface.ground) j["ground_left_out"] = true;
  j["vertices_without_color"] = surface.uncolored;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : mesh.vertices.positions) box.extend(p);
  j["box"] = {{"low", {box.min().x(), box.min().y(), box.min().z()}},
              {"high", {box.max().x(), box.max().y(), box.max().z()}}};
  if (!mesh.vertices.temperatures_k.empty()) {
    j["vertices_without_temperature"] = surface.without_temperature;
    j["temperature"] = run.thermal_is_gray ? "gray level 0..255, no temperature" : "kelvin";
  }
  if (options.colors == VertexColors::temperature)
    j["colors"] = {{"palette", options.palette},
                   {"low_k", run.span.low_k},
                   {"high_k", run.span.high_k},
                   {"none", "gray"}};
  else
    j["colors"] = "visible";
  return j;
}

}  // namespace

std::string extension_of(const fs::path& file) {
  std::string extension = file.extension().string();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return extension;
}

Result<FieldSurface> surface_of_run(const view::FinishedRun& run, const SurfaceRequest& request,
                                    const Progress& progress) {
  SurfaceFields fields;
  if (run.has(Modality::visible)) fields.visible = &run.visible;
  if (run.has(Modality::thermal)) fields.thermal = &run.thermal;
  fields.world_from_thermal = run.frame_from_thermal;
  for (const view::RecordedView& v : run.views)
    (v.modality == Modality::visible ? fields.visible_views : fields.thermal_views)
        .push_back(v.view);
  const auto& cameras = fields.visible ? fields.visible_views : fields.thermal_views;
  ORBITFUSE_ASSIGN(const Eigen::AlignedBox3d box, box_of(request, cameras));
  FieldSurfaceOptions options = request.surface;
  options.min_opacity = run.config.render.min_opacity;
  auto surface = field_surface(fields, box, options, progress);
  if (surface || request.crop != Crop::box || surface.error().kind != ErrorKind::quality)
    return surface;
  const auto object = object_box(cameras);
  return fail(ErrorKind::usage, "--crop-box", surface.error().found,
              object ? surface.error().remedy + "; the cameras look at " + words_of(*object)
                     : surface.error().remedy);
}

std::string surface_key(const view::FinishedRun& run, const SurfaceRequest& request) {
  if (run.identity.empty()) return {};
  /// One more whenever surfaces of the same fields come out differently.
  constexpr int version = 2;
  const SurfaceOptions& how = request.surface.surface;
  std::vector<double> box;
  if (request.crop == Crop::box)
    for (const Eigen::Vector3d& corner : {request.box.min(), request.box.max()})
      box.insert(box.end(), corner.begin(), corner.end());
  json ground;
  if (how.without_ground) ground = how.ground_clearance;
  return content_hash(json{version, run.identity, run.config.render.min_opacity,
                           static_cast<int>(request.crop), box, ground}
                          .dump());
}

Status check_extension(const fs::path& file) {
  const std::string extension = extension_of(file);
  for (const char* known : {".glb", ".ply", ".obj", ".las"})
    if (extension == known) return {};
  return fail(ErrorKind::usage, "--to", "'" + file.string() + "'",
              "choose a name that ends in .glb, .ply, .obj or .las");
}

bool holds_other_work(const fs::path& file) {
  const fs::path beside = file.string() + ".json";
  std::error_code ignored;
  const bool there = fs::exists(file, ignored);
  if (!fs::exists(beside, ignored)) return there;
  const auto about = stages::read_json(beside);
  if (!about || !about->is_object() || !about->contains("world_from_export")) return true;
  const json hash = about->value("file_hash", json());  // older exports have none
  return there && !hash.is_null() && hash != file_hash(file).value_or("");
}

Status write_surface(const fs::path& file, const view::FinishedRun& run,
                     const FieldSurface& surface, const ExportFrame& frame,
                     const FileOptions& options) {
  ORBITFUSE_TRY(check_extension(file));
  TriangleMesh mesh = surface.mesh;
  transform(frame, mesh);
  if (options.colors == VertexColors::temperature)
    ORBITFUSE_TRY(paint_temperatures(run, options.palette, mesh.vertices));
  const std::string extension = extension_of(file);
  if (extension == ".las" || (extension == ".ply" && options.points)) mesh.triangles.clear();
  const FileAxes axes = extension == ".glb" ? FileAxes::y_up : FileAxes::z_up;
  json about = sidecar(run, surface, mesh, frame, axes, options);
  const std::vector<std::string> comments = {"unit " + frame.unit() + ", up z; " + frame.words()};
  Status written;
  if (extension == ".glb") {
    json extras = glb_extras(about);
    extras["temperature_none"] = 0;
    written = write_glb(file, mesh, extras);
  } else if (extension == ".ply") {
    written = write_ply(file, mesh, {options.temperature_name, comments});
  } else if (extension == ".obj") {
    written = write_obj(file, mesh, comments);
  } else {
    written = write_las(file, mesh.vertices);
  }
  ORBITFUSE_TRY(written);
  ORBITFUSE_ASSIGN(about["file_hash"], file_hash(file));
  return stages::write_json(file.string() + ".json", about);
}

}  // namespace orbitfuse::exporting
