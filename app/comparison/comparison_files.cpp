// SPDX-License-Identifier: BSD-3-Clause
#include "app/comparison/comparison_files.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <limits>

#include "app/export/export_frame.hpp"
#include "app/export/glb.hpp"
#include "app/pipeline/runner.hpp"
#include "app/stages/artifacts.hpp"
#include "core/formats/ply.hpp"
#include "core/geometry/geometry_json.hpp"
#include "core/image/image_io.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::comparing {
namespace {
namespace fs = std::filesystem;
using comparison::DifferenceRegion;
using nlohmann::json;

double metres_per_unit(const ComparedRuns& runs) {
  return runs.scale ? runs.scale->metres_per_unit : 1;
}

json place_json(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

json region_json(const ComparedRuns& runs, const DifferenceRegion& region, int number) {
  const double unit = metres_per_unit(runs);
  return {{"number", number},
          {"area", region.area * unit * unit},
          {"middle", place_json(region.middle)},
          {"place", place_json(region.place)},
          {"vertices", region.vertices.size()}};
}

double extent(const ComparedRuns& runs) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : runs.after_surface.mesh.vertices.positions) box.extend(p);
  return box.isEmpty() ? 1 : box.diagonal().norm();
}

/// In AFTER's unit.
double residual(const ComparedRuns& runs) {
  return runs.registration.residual / runs.registration.before_from_after.scale;
}

/// AFTER's surface with its differences: the mesh in the export's frame, and what each vertex has.
Status write_surfaces(const fs::path& folder, const ComparedRuns& runs) {
  ORBITFUSE_ASSIGN(const exporting::ExportFrame frame,
                   exporting::export_frame(Eigen::Vector3d::Zero(), runs.scale));
  TriangleMesh mesh = runs.after_surface.mesh;
  exporting::transform(frame, mesh);
  const double span_k = difference_span_k(runs);
  VertexScalar difference{"difference", {}}, uncertainty{"uncertainty", {}}, change{"change", {}};
  mesh.vertices.colors.clear();
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const cv::Vec3b bgr = color_of(runs, i, span_k);
    mesh.vertices.colors.push_back({bgr[2], bgr[1], bgr[0]});
    difference.values.push_back(static_cast<float>(runs.difference_k(i)));
    uncertainty.values.push_back(static_cast<float>(runs.points[i].uncertainty_k));
    const bool compared =
        runs.points[i].known() || runs.change[i] != comparison::SurfaceChange::same;
    constexpr float no_temperature = 3;
    change.values.push_back(compared ? static_cast<float>(runs.change[i]) : no_temperature);
  }
  const std::string legend =
      "change 0: compared, 1: changed geometry, 2: not seen in BEFORE, 3: no temperature in both";
  ORBITFUSE_TRY(write_ply(folder / "difference.ply", mesh,
                          {"temperature",
                           {"difference and uncertainty in kelvin, NaN = not compared", legend,
                            "unit " + frame.unit() + ", up z; " + frame.words()},
                           {difference, uncertainty, change}}));
  difference.name = "_DIFFERENCE";
  uncertainty.name = "_UNCERTAINTY";
  change.name = "_CHANGE";
  json extras = exporting::glb_extras(to_json(frame, exporting::FileAxes::y_up));
  extras["change"] = legend;
  extras["span_k"] = span_k;
  return exporting::write_glb(folder / "difference.glb", mesh, extras,
                              {difference, uncertainty, change});
}

Status write_pictures(const fs::path& folder, const std::vector<ComparisonPictures>& pictures) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
    return fail(ErrorKind::device, folder.string(), error.message(), "choose another --out");
  int number = 0;
  for (const ComparisonPictures& p : pictures) {
    const std::string stem = fmt::format("{:02}", number++);
    ORBITFUSE_TRY(write_jpeg(folder / (stem + "_before.jpg"), p.before));
    ORBITFUSE_TRY(write_jpeg(folder / (stem + "_after.jpg"), p.after));
    ORBITFUSE_TRY(write_jpeg(folder / (stem + "_difference.jpg"), p.difference));
  }
  return {};
}

}  // namespace

std::string area_words(const ComparedRuns& runs, double area) {
  const double unit = metres_per_unit(runs);
  return runs.scale ? fmt::format("{:.3g} m²", area * unit * unit)
                    : fmt::format("{:.3g} square units", area);
}

std::string residual_words(const ComparedRuns& runs) {
  const std::string share =
      fmt::format("{:.2f} % of the extent", 100 * residual(runs) / extent(runs));
  return runs.scale
             ? fmt::format("{:.1f} mm ({})", 1000 * residual(runs) * metres_per_unit(runs), share)
             : share;
}

std::string ambient_words(const ComparedRuns& runs) {
  return runs.taken_k != 0
             ? fmt::format(
                   "{:+.2f} K, the median over the unchanged surface, was taken out of all "
                   "differences (--ambient)",
                   runs.taken_k)
             : fmt::format(
                   "nothing was taken out; the median over the unchanged surface is {:+.2f} K",
                   runs.common_k);
}

json to_json(const ComparedRuns& runs) {
  json j;
  j["schema"] = 1;
  j["software"] = pipeline::software_version();
  j["before"] = fs::absolute(runs.before.out).lexically_normal().string();
  j["after"] = fs::absolute(runs.after.out).lexically_normal().string();
  j["unit"] = runs.scale ? "metre" : "scene";
  if (runs.scale) j["scale"] = stages::to_json(*runs.scale);
  if (!runs.scale_doubt.empty()) j["scale_doubt"] = runs.scale_doubt;
  j["registration"] = {
      {"before_from_after", matrix_json(runs.registration.before_from_after.matrix())},
      {"residual", residual(runs) * metres_per_unit(runs)},
      {"residual_share_of_extent", residual(runs) / extent(runs)},
      {"overlap", runs.registration.overlap},
      {"scale_sigma", runs.registration.scale_sigma},  // a share; null: not known
      {"photo_support", runs.support},
      {"ambiguous", runs.registration.clouds.ambiguous},
      {"clouds", runs.registration.clouds.brief()}};
  j["common_difference_k"] = runs.common_k;
  j["taken_out_k"] = runs.taken_k;
  j["surface_shares"] = {{"compared", runs.shares.compared},
                         {"changed", runs.shares.changed},
                         {"not_seen", runs.shares.not_seen},
                         {"without_temperature", runs.shares.without_temperature}};
  j["differences"] = json::array();
  for (const DifferenceRegion& region : runs.differences) {
    json r = region_json(runs, region, static_cast<int>(j["differences"].size()) + 1);
    r["difference_k"] = region.difference_k;
    r["uncertainty_k"] = region.uncertainty_k;
    r["strongest_k"] = region.strongest_k;
    j["differences"].push_back(r);
  }
  for (const auto& [key, regions] :
       {std::pair("came", &runs.came), std::pair("gone", &runs.gone)}) {
    j[key] = json::array();
    for (const DifferenceRegion& region : *regions)
      j[key].push_back(region_json(runs, region, static_cast<int>(j[key].size()) + 1));
  }
  return j;
}

Status write_comparison(const fs::path& folder, const ComparedRuns& runs,
                        const std::vector<ComparisonPictures>& pictures) {
  ORBITFUSE_TRY(write_pictures(folder / "views", pictures));
  ORBITFUSE_TRY(write_surfaces(folder, runs));
  ORBITFUSE_TRY(stages::write_json(folder / "differences.json", to_json(runs)));
  return write_file_atomic(folder / "compare.html", to_html(runs, pictures));
}

}  // namespace orbitfuse::comparing
