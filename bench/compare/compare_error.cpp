// SPDX-License-Identifier: BSD-3-Clause
// What `orbitfuse compare` finds between two runs of a rendered scene, against what was changed:
//   compare_error BEFORE AFTER BEFORE_truth.json AFTER_truth.json --warmer X,Y,Z,SX,SY,SZ
//       --moved X,Y,Z,SX,SY,SZ [--by 5] [--ambient]
// Boxes are middles and sides in the scene's world, metres; --moved is where the part stands AFTER.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>

#include "app/comparison/compare_runs.hpp"
#include "bench/exit_status.hpp"
#include "bench/export/true_scene.hpp"
#include "core/numeric/median.hpp"

namespace orbitfuse {
namespace {
namespace fs = std::filesystem;
using comparison::SurfaceChange;

struct Options {
  fs::path before, after, before_truth, after_truth;
  std::vector<double> warmer, moved;
  double by_k = 5;
  bool ambient = false;
};

Eigen::AlignedBox3d box_of(const std::vector<double>& v, double margin_m) {
  const Eigen::Vector3d middle(v[0], v[1], v[2]),
      half = Eigen::Vector3d(v[3], v[4], v[5]) / 2 + Eigen::Vector3d::Constant(margin_m);
  return {middle - half, middle + half};
}

/// Share of an area.
struct Share {
  double of = 0, all = 0;
  void add(bool in, double area) { of += in ? area : 0, all += area; }
  double percent() const { return all > 0 ? 100 * of / all : 0; }
};

void score(const Options& o, const comparing::ComparedRuns& runs, const Similarity3d& truth) {
  const TriangleMesh& mesh = runs.after_surface.mesh;
  const std::vector<double> areas = comparison::vertex_areas(mesh);
  // Inside: away from edges, where a pixel mixes both sides. Round it: neither part nor rest.
  const Eigen::AlignedBox3d warm = box_of(o.warmer, 0.03), round_warm = box_of(o.warmer, 0.1),
                            moved = box_of(o.moved, 0.03), round_moved = box_of(o.moved, 0.1);
  std::vector<double> part, rest;
  Share masked, changed_elsewhere, beyond, covered;
  for (std::size_t i = 0; i < areas.size(); ++i) {
    const Eigen::Vector3d p = truth * mesh.vertices.positions[i];
    const double difference = runs.difference_k(i);
    const bool known = runs.points[i].known();
    if (moved.contains(p) && p.z() > 0.1) masked.add(!known, areas[i]);
    if (warm.contains(p) && known) part.push_back(difference);
    if (round_warm.contains(p) || round_moved.contains(p)) continue;
    changed_elsewhere.add(runs.change[i] == SurfaceChange::changed, areas[i]);
    if (!known) continue;
    beyond.add(std::abs(difference) > 1, areas[i]);
    covered.add(std::abs(difference) <= runs.points[i].uncertainty_k, areas[i]);
    rest.push_back(std::abs(difference));
  }
  const std::string name = runs.after.out.filename().string();
  fmt::print("{}: warmer part {:+.2f} K (true {:+.2f}), {} vertices; moved part {:.1f} % masked\n",
             name, median(part), o.by_k, part.size(), masked.percent());
  fmt::print(
      "{}: the rest: {:.1f} % within 1 K, median {:.2f} K, stated interval covers {:.1f} %; "
      "{:.2f} % of it called changed\n",
      name, 100 - beyond.percent(), median(rest), covered.percent(), changed_elsewhere.percent());
  for (const auto& region : runs.differences) {
    const Eigen::Vector3d p = truth * region.middle;
    fmt::print("{}: {:+.2f} +- {:.2f} K, {:.3f} m2 at {:.2f},{:.2f},{:.2f}{}\n", name,
               region.difference_k, region.uncertainty_k, region.area * truth.scale * truth.scale,
               p.x(), p.y(), p.z(), round_warm.contains(p) ? " (the warmer part)" : "");
  }
  fmt::print(
      "{}: compared {:.1f} %, changed {:.1f} %, not seen {:.1f} %, no temperature {:.1f} % of "
      "the surface; days differ by {:+.2f} K\n",
      name, 100 * runs.shares.compared, 100 * runs.shares.changed, 100 * runs.shares.not_seen,
      100 * runs.shares.without_temperature, runs.common_k);
}

Status run(const Options& o) {
  ORBITFUSE_ASSIGN(const GroundTruth before_truth, read_ground_truth(o.before_truth));
  ORBITFUSE_ASSIGN(const GroundTruth after_truth, read_ground_truth(o.after_truth));
  ORBITFUSE_ASSIGN(const Similarity3d truth_from_before, truth_from_run(o.before, before_truth));
  ORBITFUSE_ASSIGN(const Similarity3d truth_from_after, truth_from_run(o.after, after_truth));
  comparing::CompareRequest request;
  request.ambient = o.ambient;
  ORBITFUSE_ASSIGN(const comparing::ComparedRuns runs,
                   comparing::compare_runs(o.before, o.after, stages::RunConfig(), request, {}));
  std::vector<double> off;
  for (const Eigen::Vector3d& p : runs.after_surface.mesh.vertices.positions)
    off.push_back(
        (truth_from_before * (runs.registration.before_from_after * p) - truth_from_after * p)
            .norm());
  fmt::print(
      "registration: {:.1f} mm off in the median, residual {:.1f} mm, overlap {:.2f}, photos "
      "{:.2f}{}\n",
      1000 * median(off), 1000 * runs.registration.residual * truth_from_before.scale,
      runs.registration.overlap, runs.support,
      runs.registration.clouds.ambiguous ? ", ambiguous" : "");
  const double true_ratio = truth_from_after.scale / truth_from_before.scale;
  fmt::print("registration: scale {:+.3f} % off, stated +- {:.3f} % (one sigma)\n",
             100 * (runs.registration.before_from_after.scale / true_ratio - 1),
             100 * runs.registration.scale_sigma);
  score(o, runs, truth_from_after);
  return {};
}

}  // namespace
}  // namespace orbitfuse

int main(int argc, char** argv) {
  CLI::App app("A comparison of two runs against what was changed in the scene");
  orbitfuse::Options o;
  app.add_option("before", o.before, "--out folder of the earlier run")->required();
  app.add_option("after", o.after, "--out folder of the later run")->required();
  app.add_option("before_truth", o.before_truth, "ground_truth.json")->required();
  app.add_option("after_truth", o.after_truth, "ground_truth.json")->required();
  app.add_option("--warmer", o.warmer, "Box")->delimiter(',')->expected(6)->required();
  app.add_option("--moved", o.moved, "Box")->delimiter(',')->expected(6)->required();
  app.add_option("--by", o.by_k, "Kelvin")->capture_default_str();
  app.add_flag("--ambient", o.ambient, "Take out what the days differ by");
  CLI11_PARSE(app, argc, argv);
  return orbitfuse::exit_status(orbitfuse::run(o));
}
