// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/cloud_scenes.hpp"
#include "tests/support/shared_data.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <numeric>

namespace orbitfuse::scenes {
namespace {

using Eigen::Vector3d;

/// The Stanford bunny's ASCII PLY, faces included (core/ply reads vertices only).
std::optional<Surface> read_bunny(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::string word;
  std::size_t vertices = 0, faces = 0;
  while (in >> word && word != "end_header") {
    if (word != "element") continue;
    in >> word;
    if (word == "vertex") in >> vertices;
    if (word == "face") in >> faces;
  }
  if (!in) return std::nullopt;
  Positions points(vertices);
  double confidence, intensity;
  for (auto& p : points) in >> p.x() >> p.y() >> p.z() >> confidence >> intensity;
  Surface surface;
  for (std::size_t f = 0; f < faces; ++f) {
    std::size_t corners, a, b, c;
    if (!(in >> corners >> a >> b >> c) || corners != 3 || std::max({a, b, c}) >= vertices)
      return std::nullopt;
    surface.triangle(points[a], points[b], points[c]);
  }
  return surface;
}

/// A furnished room, ceiling left open.
Surface indoor() {
  Surface s;
  const Vector3d size(5.2, 4.1, 2.6);
  s.quad({0, 0, 0}, {size.x(), 0, 0}, {size.x(), size.y(), 0}, {0, size.y(), 0});
  s.quad({0, 0, 0}, {size.x(), 0, 0}, {size.x(), 0, size.z()}, {0, 0, size.z()});
  s.quad({0, 0, 0}, {0, size.y(), 0}, {0, size.y(), size.z()}, {0, 0, size.z()});
  s.quad({size.x(), 0, 0}, {size.x(), 2.4, 0}, {size.x(), 2.4, size.z()}, {size.x(), 0, size.z()});
  s.box({1.6, 1.4, 0.70}, {3.2, 2.3, 0.76});  // table
  for (const double x : {1.65, 3.10}) {
    for (const double y : {1.45, 2.20}) s.box({x, y, 0}, {x + 0.06, y + 0.06, 0.70});
  }
  s.box({0.1, 2.6, 0}, {1.0, 4.0, 0.42});  // sofa
  s.box({0.1, 2.6, 0.42}, {0.3, 4.0, 0.85});
  s.box({3.9, 0.05, 0}, {5.0, 0.45, 1.9});  // shelf
  s.box({0.4, 0.1, 0}, {1.3, 0.6, 0.5});
  s.cylinder({4.6, 3.5, 0}, {4.6, 3.5, 1.5}, 0.04);  // lamp
  s.cylinder({4.6, 3.5, 1.4}, {4.6, 3.5, 1.75}, 0.25);
  s.cylinder({2.3, 1.8, 0.76}, {2.3, 1.8, 1.02}, 0.11);
  s.box({3.4, 1.6, 0}, {3.8, 2.0, 0.45});  // chair
  s.box({3.75, 1.6, 0.45}, {3.8, 2.0, 0.95});
  return s;
}

/// A notchback on a patch of ground: left and right are mirrored but for the exhaust, front and
/// back differ by a longer, lower bonnet only.
Surface car() {
  Surface s;
  const auto profile = [&](const std::vector<std::pair<double, double>>& outline, double half_low,
                           double half_high) {
    // (x, z) outline, closed; half width changes linearly with height.
    double low = 1e9, high = -1e9;
    for (const auto& [x, z] : outline) {
      low = std::min(low, z);
      high = std::max(high, z);
    }
    const auto half = [&](double z) {
      return half_low + (half_high - half_low) * (z - low) / (high - low);
    };
    Vector3d left_center = Vector3d::Zero();
    for (const auto& [x, z] : outline)
      left_center += Vector3d(x, half(z), z) / static_cast<double>(outline.size());
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const auto [x0, z0] = outline[i];
      const auto [x1, z1] = outline[(i + 1) % outline.size()];
      const Vector3d a(x0, half(z0), z0), b(x1, half(z1), z1);
      const Vector3d am(x0, -half(z0), z0), bm(x1, -half(z1), z1);
      s.quad(a, b, bm, am);
      s.triangle(a, b, left_center);
      s.triangle(am, bm, Vector3d(left_center.x(), -left_center.y(), left_center.z()));
    }
  };
  profile({{-2.20, 0.35}, {2.25, 0.35}, {2.30, 0.62}, {2.15, 0.80}, {-2.10, 0.92}, {-2.25, 0.66}},
          0.88, 0.84);
  profile({{-1.55, 0.90}, {1.05, 0.84}, {0.35, 1.40}, {-0.85, 1.42}}, 0.80, 0.58);
  for (const double x : {-1.35, 1.40}) {
    for (const double y : {-0.92, 0.72}) s.cylinder({x, y, 0.32}, {x, y + 0.2, 0.32}, 0.32);
  }
  s.box({0.75, 0.86, 0.88}, {0.95, 1.05, 1.02});  // mirrors
  s.box({0.75, -1.05, 0.88}, {0.95, -0.86, 1.02});
  s.cylinder({-2.4, 0.5, 0.3}, {-2.1, 0.5, 0.3}, 0.05);
  s.quad({-2.9, -1.5, 0}, {2.9, -1.5, 0}, {2.9, 1.5, 0}, {-2.9, 1.5, 0});
  return s;
}

Vector3d direction(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Vector3d(normal(random), normal(random), normal(random)).normalized();
}

/// Keeps the share of points that is lowest along an axis.
void keep_lowest(Positions& points, const Vector3d& axis, double share) {
  std::sort(points.begin(), points.end(),
            [&](const Vector3d& a, const Vector3d& b) { return a.dot(axis) < b.dot(axis); });
  points.resize(static_cast<std::size_t>(share * static_cast<double>(points.size())));
}

void punch_holes(Positions& points, double share, double diameter, std::mt19937& random) {
  const std::size_t wanted =
      static_cast<std::size_t>((1 - share) * static_cast<double>(points.size()));
  while (points.size() > wanted) {
    const Vector3d center =
        points[std::uniform_int_distribution<std::size_t>(0, points.size() - 1)(random)];
    const double radius = diameter * std::uniform_real_distribution<double>(0.05, 0.12)(random);
    std::erase_if(points, [&](const Vector3d& p) { return (p - center).norm() < radius; });
  }
}

/// A NeRF's floaters: blobs of points near, but off, the surface.
void add_floaters(Positions& points, double share, double diameter, std::mt19937& random) {
  std::normal_distribution<double> normal;
  auto left = static_cast<int>(share / (1 - share) * static_cast<double>(points.size()));
  const Positions surface = points;
  while (left > 0) {
    const Vector3d anchor =
        surface[std::uniform_int_distribution<std::size_t>(0, surface.size() - 1)(random)];
    const Vector3d center =
        anchor +
        diameter * std::uniform_real_distribution<double>(0.03, 0.20)(random) * direction(random);
    const double size = diameter * std::uniform_real_distribution<double>(0.005, 0.03)(random);
    const int count = std::min(left, std::uniform_int_distribution<int>(5, 40)(random));
    for (int i = 0; i < count; ++i)
      points.push_back(center + size * Vector3d(normal(random), normal(random), normal(random)));
    left -= count;
  }
}

/// Both shuffled alike.
void shuffle_together(Positions& points, Positions& companions, std::mt19937& random) {
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::shuffle(order.begin(), order.end(), random);
  const Positions old_points = points, old_companions = companions;
  for (std::size_t i = 0; i < order.size(); ++i) {
    points[i] = old_points[order[i]];
    companions[i] = old_companions[order[i]];
  }
}

/// `truth` holds where the points come from.
void add_outliers(Positions& points, Positions& truth, double share, std::mt19937& random) {
  Vector3d low = points[0], high = points[0];
  for (const auto& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const Vector3d center = 0.5 * (low + high), half = 0.6 * (high - low);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto count = static_cast<int>(share * static_cast<double>(points.size()));
  shuffle_together(points, truth, random);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    points[i] = center + half.cwiseProduct(Vector3d(unit(random), unit(random), unit(random)));
    truth[i].setConstant(NAN);
  }
}

void warp(Positions& points, double amplitude, double diameter, std::mt19937& random) {
  std::uniform_real_distribution<double> phase(0, 2 * std::numbers::pi);
  for (int wave = 0; wave < 3; ++wave) {
    const Vector3d axis = direction(random), push = direction(random);
    const double shift = phase(random), k = 2 * std::numbers::pi / (0.8 * diameter);
    for (auto& p : points)
      p += amplitude * diameter / std::numbers::sqrt3 * std::sin(k * p.dot(axis) + shift) * push;
  }
}

}  // namespace

void Surface::triangle(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const double area = 0.5 * (b - a).cross(c - a).norm();
  triangles_.push_back({a, b, c});
  area_until_.push_back((area_until_.empty() ? 0 : area_until_.back()) + area);
}
void Surface::quad(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  triangle(a, b, c);
  triangle(a, c, d);
}
void Surface::box(const Vector3d& l, const Vector3d& h) {
  quad({l.x(), l.y(), l.z()}, {h.x(), l.y(), l.z()}, {h.x(), h.y(), l.z()}, {l.x(), h.y(), l.z()});
  quad({l.x(), l.y(), h.z()}, {h.x(), l.y(), h.z()}, {h.x(), h.y(), h.z()}, {l.x(), h.y(), h.z()});
  quad({l.x(), l.y(), l.z()}, {h.x(), l.y(), l.z()}, {h.x(), l.y(), h.z()}, {l.x(), l.y(), h.z()});
  quad({l.x(), h.y(), l.z()}, {h.x(), h.y(), l.z()}, {h.x(), h.y(), h.z()}, {l.x(), h.y(), h.z()});
  quad({l.x(), l.y(), l.z()}, {l.x(), h.y(), l.z()}, {l.x(), h.y(), h.z()}, {l.x(), l.y(), h.z()});
  quad({h.x(), l.y(), l.z()}, {h.x(), h.y(), l.z()}, {h.x(), h.y(), h.z()}, {h.x(), l.y(), h.z()});
}
void Surface::cylinder(const Vector3d& from, const Vector3d& to, double radius) {
  const Vector3d axis = (to - from).normalized(), u = axis.unitOrthogonal(), v = axis.cross(u);
  constexpr int sides = 24;
  for (int i = 0; i < sides; ++i) {
    const double a = 2 * std::numbers::pi * i / sides, b = 2 * std::numbers::pi * (i + 1) / sides;
    const Vector3d p = radius * (std::cos(a) * u + std::sin(a) * v),
                   q = radius * (std::cos(b) * u + std::sin(b) * v);
    quad(from + p, from + q, to + q, to + p);
    triangle(from, from + p, from + q);
    triangle(to, to + p, to + q);
  }
}
Positions Surface::sample(int count, std::mt19937& random) const {
  std::uniform_real_distribution<double> unit(0, 1);
  Positions points;
  for (int i = 0; i < count; ++i) {
    const auto at =
        std::lower_bound(area_until_.begin(), area_until_.end(), unit(random) * area_until_.back());
    const auto& [a, b, c] = triangles_[std::min(static_cast<std::size_t>(at - area_until_.begin()),
                                                triangles_.size() - 1)];
    double u = unit(random), v = unit(random);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    points.push_back(a + u * (b - a) + v * (c - a));
  }
  return points;
}
double Surface::diameter() const {
  Vector3d low = triangles_[0][0], high = low;
  for (const auto& t : triangles_) {
    for (const auto& p : t) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  }
  return (high - low).norm();
}

double Surface::radius() const {
  Vector3d center = Vector3d::Zero();
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    const double area = area_until_[i] - (i > 0 ? area_until_[i - 1] : 0);
    center +=
        area / area_until_.back() * (triangles_[i][0] + triangles_[i][1] + triangles_[i][2]) / 3;
  }
  double radius = 0;
  for (const auto& t : triangles_) {
    for (const auto& p : t) radius = std::max(radius, (p - center).norm());
  }
  return radius;
}

std::optional<Surface> surface(const std::string& name) {
  if (name == "indoor") return indoor();
  if (name == "car") return car();
  if (name == "bunny") return read_bunny(testing::shared_data() / "clouds" / "bun_zipper_res3.ply");
  return std::nullopt;
}

const std::vector<Level>& levels() {
  static const std::vector<Level> all = [] {
    std::vector<Level> l(9);
    l[0].name = "clean";
    l[1].name = "noise 0.5 %";
    l[1].noise = 0.005;
    l[2].name = "noise 1 %, density x4";
    l[2].noise = 0.01;
    l[2].target_points = 12000;
    l[3].name = "overlap 75 %";
    l[3].overlap = 0.75;
    l[4].name = "overlap 50 %";
    l[4].overlap = 0.5;
    l[4].success_bar = 0.9;
    l[5].name = "outliers 30 %";
    l[5].outliers = 0.3;
    l[6].name = "outliers 80 %";
    l[6].outliers = 0.8;
    l[6].success_bar = 0.8;
    l[7].name = "gap, mild";
    l[7].holes = 0.2;
    l[7].floaters = 0.08;
    l[7].noise = 0.005;
    l[8].name = "gap, hard";
    l[8].holes = 0.4;
    l[8].floaters = 0.2;
    l[8].noise = 0.005;
    l[8].warp = 0.01;
    l[8].overlap = 0.8;
    l[8].success_bar = 0.85;
    return l;
  }();
  return all;
}

CloudPair make_pair(const Surface& surface, const Level& level, std::uint32_t seed) {
  std::mt19937 random(seed);
  const double diameter = surface.diameter();
  CloudPair pair;
  pair.check = surface.sample(500, random);
  // With a share f of the points kept at opposite ends, 2 f - 1 of f is common.
  const double kept = 1 / (2 - level.overlap);
  const auto grow = [&](int count) {
    return static_cast<int>(count / kept / (1 - (level.holes > 0 ? level.holes : 0)));
  };
  Positions source = surface.sample(grow(level.source_points), random);
  Positions target = surface.sample(
      level.overlap < 1 ? static_cast<int>(level.target_points / kept) : level.target_points,
      random);
  if (level.overlap < 1) {
    const Vector3d axis = direction(random);
    keep_lowest(source, axis, kept);
    keep_lowest(target, -axis, kept);
  }
  if (level.holes > 0) punch_holes(source, level.holes, diameter, random);
  Positions source_truth = source, target_truth = target;
  if (level.warp > 0) warp(source, level.warp, diameter, random);
  if (level.floaters > 0) add_floaters(source, level.floaters, diameter, random);
  source_truth.resize(source.size(), Vector3d::Constant(NAN));
  std::normal_distribution<double> normal;
  for (const auto& [cloud, origin] :
       {std::pair(&source, &source_truth), std::pair(&target, &target_truth)}) {
    if (level.outliers > 0) add_outliers(*cloud, *origin, level.outliers, random);
    if (level.noise > 0) {
      for (auto& p : *cloud)
        p += level.noise * diameter * Vector3d(normal(random), normal(random), normal(random));
    }
    shuffle_together(*cloud, *origin, random);
  }
  std::uniform_real_distribution<double> unit(-1, 1);
  Similarity3d& truth = pair.target_from_source;
  truth.scale = std::exp(std::log(0.3) + (unit(random) + 1) / 2 * std::log(10.0));
  truth.rotation =
      Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
          .normalized();
  truth.translation = 3 * diameter * Vector3d(unit(random), unit(random), unit(random));
  for (auto& p : target) p = truth * p;
  for (auto& p : source_truth) p = truth * p;
  pair.source_truth = std::move(source_truth);
  pair.diameter = truth.scale * diameter;
  pair.source.positions = std::move(source);
  pair.target.positions = std::move(target);
  return pair;
}

double surface_rmse_percent(const CloudPair& pair, const Similarity3d& estimate) {
  double sum = 0;
  for (const auto& p : pair.check)
    sum += (estimate * p - pair.target_from_source * p).squaredNorm();
  return 100 * std::sqrt(sum / static_cast<double>(pair.check.size())) / pair.diameter;
}

}  // namespace orbitfuse::scenes
