// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <random>

#include "recon/poses/frame_camera.hpp"
#include "recon/poses/sfm/tracks.hpp"
#include "tests/support/orbit_fixture.hpp"

// What feature detection and matching would say of a machine inside four equal walls of equal
// pillars: the machine's points are distinct, a pillar's are those of any other.
namespace orbitfuse::testing_orbit {

struct FeatureScene {
  Session session;
  std::vector<PosedView> truth;
  FeatureGraph graph;
  /// The scene point of each feature, by view; pillars count on after the machine's.
  std::vector<std::vector<int>> point_of;
};

struct FeatureSceneOptions {
  int machine_points = 240;
  int pillar_points = 18;     ///< of each of the seven pillars of each wall
  double wrong_pillar = 0.6;  ///< share of pairs in which each pillar is taken for its neighbour
  double false_matches = 0.1;
  unsigned seed = 1;
};

class FeatureSceneMaker {
 public:
  explicit FeatureSceneMaker(const FeatureSceneOptions& options)
      : options_(options), rng_(options.seed) {}

  FeatureScene make() {
    FeatureScene scene;
    scene.truth = two_loops();
    add_frames(scene);
    place_points();
    for (const PosedView& view : scene.truth) see(scene, view);
    for (const ViewPair& pair : orbit_pairs(scene.graph.frames)) match(scene, pair);
    return scene;
  }

 private:
  static constexpr int pillars = 7;

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(rng_);
  }

  static void add_frames(FeatureScene& scene) {
    DeviceInfo device;
    device.id = "visible0";
    device.lens.focal_px = 600;
    scene.session.devices.push_back(device);
    for (std::size_t v = 0; v < scene.truth.size(); ++v) {
      FrameRecord frame;
      frame.device = "visible0";
      frame.file = scene.truth[v].name;
      frame.width = 640, frame.height = 480;
      frame.sequence = v;
      Station station;
      station.loop = static_cast<int>(v) / 12, station.index = static_cast<int>(v) % 12;
      station.azimuth_deg = 30.0 * station.index;
      station.elevation_sigma_deg.reset();
      frame.station = station;
      scene.session.frames.push_back(frame);
    }
    for (const FrameRecord& frame : scene.session.frames) {
      scene.graph.frames.push_back(&frame);
      scene.graph.cameras.push_back(sfm_prior_camera(scene.session, frame));
    }
  }

  void place_points() {
    for (int i = 0; i < options_.machine_points; ++i)
      points_.emplace_back(uniform(-0.8, 0.8), uniform(-0.8, 0.8), uniform(-0.8, 0.8));
    std::vector<Eigen::Vector3d> pattern;  // about a pillar's foot: along the wall, out of it, up
    for (int i = 0; i < options_.pillar_points; ++i)
      pattern.emplace_back(uniform(-0.15, 0.15), uniform(0, 0.3), uniform(-1, 2));
    for (int wall = 0; wall < 4; ++wall) {
      const Eigen::AngleAxisd turn(wall * EIGEN_PI / 2, Eigen::Vector3d::UnitZ());
      for (int p = 0; p < pillars; ++p)
        for (const Eigen::Vector3d& x : pattern)
          points_.push_back(turn *
                            Eigen::Vector3d(1.4 * (p - pillars / 2) + x.x(), 5.2 - x.y(), x.z()));
    }
  }

  void see(FeatureScene& scene, const PosedView& view) {
    const Eigen::Vector3d center = camera_center(view.cam_from_world);
    std::vector<Eigen::Vector2d> pixels;
    std::vector<int> ids;
    for (int i = 0; i < static_cast<int>(points_.size()); ++i) {
      const Eigen::Vector3d& x = points_[static_cast<std::size_t>(i)];
      // A solid machine hides its far side.
      if (i < options_.machine_points && x.normalized().dot(center.normalized()) < 0.1) continue;
      const Eigen::Vector2d p = view.camera.project(view.cam_from_world * x);
      if (!p.allFinite() || p.x() < 0 || p.y() < 0 || p.x() >= 640 || p.y() >= 480) continue;
      std::normal_distribution<double> noise(0, 0.3);
      pixels.emplace_back(p.x() + noise(rng_), p.y() + noise(rng_));
      ids.push_back(i);
    }
    Eigen::Matrix2Xd columns(2, static_cast<Eigen::Index>(pixels.size()));
    for (std::size_t i = 0; i < pixels.size(); ++i)
      columns.col(static_cast<Eigen::Index>(i)) = pixels[i];
    scene.graph.pixels.push_back(columns);
    scene.graph.descriptors.emplace_back(0, 128);
    scene.point_of.push_back(ids);
  }

  /// The same point `shift` pillars on along its wall; -1 beyond the last.
  int shifted(int point, int shift) const {
    if (point < options_.machine_points) return point;
    const int pillar = (point - options_.machine_points) / options_.pillar_points % pillars;
    if (pillar + shift < 0 || pillar + shift >= pillars) return -1;
    return point + shift * options_.pillar_points;
  }

  void match(FeatureScene& scene, const ViewPair& pair) {
    const auto &from = scene.point_of[static_cast<std::size_t>(pair.first)],
               &to = scene.point_of[static_cast<std::size_t>(pair.second)];
    const int shift = uniform(0, 1) > options_.wrong_pillar ? 0 : (uniform(0, 1) < 0.5 ? 1 : -1);
    std::vector<FeatureMatch> matches;
    for (std::size_t i = 0; i < from.size(); ++i) {
      const auto there = std::find(to.begin(), to.end(), shifted(from[i], shift));
      // Distinct points look other from the next station; plain pillars look alike.
      const bool machine = from[i] < options_.machine_points;
      if (there == to.end() || uniform(0, 1) > (machine ? 0.35 : 0.9)) continue;
      int target = static_cast<int>(there - to.begin());
      if (uniform(0, 1) < options_.false_matches)
        target = static_cast<int>(uniform(0, static_cast<double>(to.size()) - 0.01));
      matches.emplace_back(static_cast<int>(i), target);
    }
    scene.graph.proposed[pair] = std::move(matches);
  }

  FeatureSceneOptions options_;
  std::mt19937 rng_;
  std::vector<Eigen::Vector3d> points_;
};

/// Descriptors of the points (pillars alike), noise added; all matches between neighbours right.
inline FeatureScene described_scene() {
  FeatureSceneOptions options;
  options.wrong_pillar = options.false_matches = 0;
  FeatureScene scene = FeatureSceneMaker(options).make();
  std::mt19937 rng(3);
  std::normal_distribution<float> normal(0, 1);
  const auto random_row = [&] {
    Eigen::RowVectorXf row(128);
    for (Eigen::Index c = 0; c < 128; ++c) row(c) = std::abs(normal(rng));
    return Eigen::RowVectorXf(row.normalized());
  };
  std::map<int, Eigen::RowVectorXf> of_point;
  for (std::size_t v = 0; v < scene.point_of.size(); ++v) {
    Descriptors& rows = scene.graph.descriptors[v];
    rows.resize(static_cast<Eigen::Index>(scene.point_of[v].size()), 128);
    for (std::size_t i = 0; i < scene.point_of[v].size(); ++i) {
      const int point = scene.point_of[v][i];
      const int look =
          point < options.machine_points
              ? point
              : options.machine_points + (point - options.machine_points) % options.pillar_points;
      if (!of_point.contains(look)) of_point[look] = random_row();
      const Eigen::RowVectorXf noisy = of_point[look] + 0.2f * random_row();
      rows.row(static_cast<Eigen::Index>(i)) = (512 * noisy.normalized()).array().round();
    }
  }
  scene.graph.verified = scene.graph.proposed;
  return scene;
}

/// Largest distance of a centre from the truth after the best similarity, in orbit radii.
inline double worst_center(const Reconstruction& model, const std::vector<PosedView>& truth) {
  std::vector<Eigen::Vector3d> found, known;
  for (const PosedView& view : model.views)
    for (const PosedView& t : truth)
      if (t.name == view.name) {
        found.push_back(camera_center(view.cam_from_world));
        known.push_back(camera_center(t.cam_from_world));
      }
  Eigen::Matrix3Xd from(3, static_cast<Eigen::Index>(found.size())), to = from;
  for (std::size_t i = 0; i < found.size(); ++i) {
    from.col(static_cast<Eigen::Index>(i)) = found[i];
    to.col(static_cast<Eigen::Index>(i)) = known[i];
  }
  const Eigen::Matrix4d m = Eigen::umeyama(from, to, true);
  double worst = 0;
  for (std::size_t i = 0; i < found.size(); ++i)
    worst = std::max(
        worst, (m.topLeftCorner<3, 3>() * found[i] + m.topRightCorner<3, 1>() - known[i]).norm() /
                   known[i].norm());
  return worst;
}

}  // namespace orbitfuse::testing_orbit
