// SPDX-License-Identifier: BSD-3-Clause
// An exported surface against the true one of a rendered scene:
//   surface_error RUN SURFACE.ply TRUE.ply ground_truth.json --extent 4.9
// RUN: --out folder of `orbitfuse run`; SURFACE.ply: of `orbitfuse export RUN --to SURFACE.ply`;
// TRUE.ply: of true_mesh.py; ground_truth.json: the scene's. The run's cameras say how its world
// lies in the true one. Temperatures are compared with the noise-free test views.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>
#include <nlohmann/json.hpp>

#include "app/stages/artifacts.hpp"
#include "bench/exit_status.hpp"
#include "bench/export/true_scene.hpp"
#include "core/geometry/lifted.hpp"
#include "core/image/image_io.hpp"
#include "recon/surface/surface.hpp"

namespace orbitfuse {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;

struct Options {
  fs::path run, surface, true_mesh, truth;
  double extent_m = 0, spacing_m = 0.01, ground_m = 0.05;
};

double distance_to_triangle(const Eigen::Vector3d& p, const std::array<Eigen::Vector3d, 3>& t) {
  const Eigen::Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
  bool within = normal.norm() > 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d edge = t[(k + 1) % 3] - t[k], to = p - t[k];
    within &= normal.dot(edge.cross(to)) >= 0;
    const double share = std::clamp(to.dot(edge) / std::max(edge.squaredNorm(), 1e-30), 0.0, 1.0);
    nearest = std::min(nearest, (to - share * edge).norm());
  }
  return within ? std::abs((p - t[0]).dot(normal.normalized())) : nearest;
}

/// Distances to a mesh within a ball: exact to the triangles that have samples nearest by.
class Nearest {
 public:
  Nearest(const TriangleMesh& mesh, const Eigen::Vector3d& center, double radius, double spacing)
      : mesh_(mesh) {
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const auto t = corners(i);
      const double side =
          std::max({(t[1] - t[0]).norm(), (t[2] - t[0]).norm(), (t[2] - t[1]).norm()});
      const int steps = static_cast<int>(std::ceil(side / spacing));
      for (int a = 0; a <= steps; ++a)
        for (int b = 0; a + b <= steps; ++b) {
          const Eigen::Vector3d p =
              t[0] + (t[1] - t[0]) * (1.0 * a / steps) + (t[2] - t[0]) * (1.0 * b / steps);
          if (!((p - center).norm() <= radius)) continue;
          list_.push_back(p);
          of_.push_back(i);
        }
    }
    tree_ = std::make_unique<Tree>(3, *this);
  }
  double distance(const Eigen::Vector3d& p) const {
    constexpr std::size_t most = 8;
    std::uint32_t index[most];
    double squared[most];
    const std::size_t found = tree_->knnSearch(p.data(), most, index, squared);
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < found; ++k)
      nearest = std::min(nearest, distance_to_triangle(p, corners(of_[index[k]])));
    return nearest;
  }
  std::size_t kdtree_get_point_count() const { return list_.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t d) const {
    return list_[i][static_cast<Eigen::Index>(d)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }

 private:
  using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Nearest>,
                                                   Nearest, 3>;
  std::array<Eigen::Vector3d, 3> corners(std::size_t i) const {
    const auto& t = mesh_.triangles[i];
    const auto& p = mesh_.vertices.positions;
    return {p[t[0]], p[t[1]], p[t[2]]};
  }
  const TriangleMesh& mesh_;
  std::vector<Eigen::Vector3d> list_;
  std::vector<std::size_t> of_;
  std::unique_ptr<Tree> tree_;
};

std::string told(std::vector<double> values, double unit, const char* words) {
  if (values.empty()) return "none";
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return values[std::min(values.size() - 1,
                           static_cast<std::size_t>(share * static_cast<double>(values.size())))] /
           unit;
  };
  return fmt::format("median {:.3f} {}, 90 % {:.3f} {} ({})", at(0.5), words, at(0.9), words,
                     values.size());
}

struct Errors {
  std::vector<double> object, ground;
  void add(bool of_object, double value) { (of_object ? object : ground).push_back(value); }
  void tell(const char* what, double unit, const char* words) const {
    fmt::print("  {}: object {}; ground {}\n", what, told(object, unit, words),
               told(ground, unit, words));
  }
};

/// Whether the pixel shows one surface, which lies at depth z.
bool shows(const cv::Mat& depth, const Eigen::Vector2d& pixel, double z) {
  const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
  if (x < 2 || y < 2 || x + 2 >= depth.cols || y + 2 >= depth.rows) return false;
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx)
      if (!(std::abs(static_cast<double>(depth.at<float>(y + dy, x + dx)) - z) < 0.03 * z))
        return false;
  return true;
}

Status run(const Options& o) {
  ORBITFUSE_ASSIGN(const GroundTruth truth, read_ground_truth(o.truth));
  ORBITFUSE_ASSIGN(const Similarity3d fit, truth_from_run(o.run, truth));
  ORBITFUSE_ASSIGN(TriangleMesh surface, read_mesh(o.surface));
  ORBITFUSE_ASSIGN(const json sidecar, stages::read_json(o.surface.string() + ".json"));
  Eigen::Matrix4d run_from_export;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c)
      run_from_export(r, c) = sidecar.at("world_from_export")
                                  .at(static_cast<std::size_t>(r))
                                  .at(static_cast<std::size_t>(c));
  Eigen::AlignedBox3d box;
  for (Eigen::Vector3d& p : surface.vertices.positions) {
    p = fit * Eigen::Vector3d((run_from_export * p.homogeneous()).head<3>());
    box.extend(p);
  }
  ORBITFUSE_ASSIGN(const TriangleMesh true_mesh, read_mesh(o.true_mesh));
  const double reach = box.diagonal().norm() / 2;
  const Nearest to_truth(true_mesh, box.center(), 1.3 * reach, o.spacing_m);
  Errors off;
  for (std::size_t i = 0; i < surface.vertices.size(); i += 3) {
    const Eigen::Vector3d& p = surface.vertices.positions[i];
    off.add(p.z() > o.ground_m, to_truth.distance(p));
  }
  fmt::print("{}: {} vertices, {} triangles; extent {:.2f} m\n", o.surface.string(),
             surface.vertices.size(), surface.triangles.size(), o.extent_m);
  off.tell("distance of its vertices to the true surface", o.extent_m / 100, "% of the extent");

  const Nearest to_surface(surface, box.center(), 1.3 * reach, o.spacing_m);
  Errors missing, temperature;
  double bias = 0;
  for (const TrueTestView& test : truth.test) {
    const PosedView view{"test", test.camera.without_distortion(), test.cam_from_world};
    const cv::Mat depth = mesh_depth(true_mesh, view);
    for (int y = 0; y < depth.rows; y += 3)
      for (int x = 0; x < depth.cols; x += 3) {
        const Eigen::Vector3d p = view.cam_from_world.inverse() * lifted(depth, view.camera, x, y);
        if (box.contains(p)) missing.add(p.z() > o.ground_m, to_surface.distance(p));
      }
    ORBITFUSE_ASSIGN(const cv::Mat kelvin, read_thermal_k(test.thermal));
    for (std::size_t i = 0; i < surface.vertices.temperatures_k.size(); ++i) {
      const Eigen::Vector3d& p = surface.vertices.positions[i];
      const Eigen::Vector3d x = view.cam_from_world * p;
      const Eigen::Vector2d pixel = view.camera.project(x);
      if (!pixel.allFinite() || !shows(depth, pixel, x.z())) continue;
      const float there =
          kelvin.at<float>(static_cast<int>(pixel.y()), static_cast<int>(pixel.x()));
      const double error = static_cast<double>(surface.vertices.temperatures_k[i] - there);
      if (!std::isfinite(error)) continue;
      temperature.add(p.z() > o.ground_m, std::abs(error));
      bias += error;
    }
  }
  missing.tell("distance of what test views see to it", o.extent_m / 100, "% of the extent");
  temperature.tell("temperature at vertices", 1, "K");
  fmt::print(
      "  mean of the temperatures' errors {:+.3f} K; {} vertices without one\n",
      bias / static_cast<double>(temperature.object.size() + temperature.ground.size()),
      std::count_if(surface.vertices.temperatures_k.begin(), surface.vertices.temperatures_k.end(),
                    [](float t) { return std::isnan(t); }));
  return {};
}

}  // namespace
}  // namespace orbitfuse

int main(int argc, char** argv) {
  CLI::App app("An exported surface against the true one");
  orbitfuse::Options options;
  app.add_option("run", options.run, "--out folder of a run")->required();
  app.add_option("surface", options.surface, "PLY that export wrote, its .json beside it")
      ->required();
  app.add_option("true_mesh", options.true_mesh, "PLY of true_mesh.py")->required();
  app.add_option("truth", options.truth, "ground_truth.json")->required();
  app.add_option("--extent", options.extent_m, "The object's longest side, metres")->required();
  app.add_option("--spacing", options.spacing_m, "Of samples on surfaces, metres")
      ->capture_default_str();
  app.add_option("--ground", options.ground_m, "What lies higher is the object, metres")
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return orbitfuse::exit_status(orbitfuse::run(options));
}
