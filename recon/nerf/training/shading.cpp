// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/shading.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/geometry/lens_fold.hpp"
#include "core/geometry/lifted.hpp"
#include "core/numeric/median.hpp"
#include "recon/nerf/training/confirms.hpp"
#include "recon/nerf/training/even_sample.hpp"

namespace orbitfuse::nerf {
namespace {

/// Between the points of a depth map, at least; more where many views see many of them.
constexpr int least_step_px = 3;
constexpr double most_places = 33000;
constexpr std::size_t most_views = 24;  ///< asked for a place, spread over the orbit
constexpr double least_facing =
    0.2;  ///< cosine of the angle to the normal; a sharper limit would choose samples by what
          ///< explains them, and doubles the falloff (docs/notes/nerf.md)
constexpr float edge_k = 1.0F;  ///< range of 5x5 pixels: beyond, poses decide what is seen
constexpr int least_points = 300;
constexpr double least_k = 0.08;  ///< smaller ones are no more than what the angle leaves over
constexpr double largest_k = 5;   ///< no shading: a wrong frame, or a lens cap
constexpr double least_residual_k = 0.05;
/// Of a ball in the middle of a ring r^2 is the angle's: one can't be told from the other.
constexpr double least_alone = 0.3;  // .89 to .96 on seven orbits
constexpr int groups = 8;            ///< of views, for the jackknife
constexpr double sure = 3;           ///< sigmas

/// What a sample may have too little or too much by: its place in the image (shading_r2), and how
/// flat the view is, 1 - cos and its square: surfaces emit less that way, more than any lens does.
constexpr int causes = 3;
using Causes = Eigen::Matrix<double, causes, 1>;

struct ShadedSample {
  int view;
  double kelvin;
  Causes by;
  double weight = 1;
};
using ShadedPoint = std::vector<ShadedSample>;

/// A place on a surface.
struct SurfacePlace {
  Eigen::Vector3d world, normal;
};

/// None where the map has no depth, or a step, round the pixel.
std::optional<SurfacePlace> place_at(const DepthMap& map, const Rigid3d& world_from_cam, int x,
                                     int y) {
  const Eigen::Vector3d middle = lifted(map.depth, map.camera, x, y);
  const Eigen::Vector3d across =
      lifted(map.depth, map.camera, x + 1, y) - lifted(map.depth, map.camera, x - 1, y);
  const Eigen::Vector3d down =
      lifted(map.depth, map.camera, x, y + 1) - lifted(map.depth, map.camera, x, y - 1);
  const Eigen::Vector3d normal = across.cross(down);
  // Not written as "beyond": NaN fails too.
  if (!(normal.norm() > 0) || !std::isfinite(normal.norm())) return std::nullopt;
  return SurfacePlace{world_from_cam * middle, (world_from_cam.rotation * normal).normalized()};
}

std::optional<ShadedSample> seen_by(const Dataset& data, const DepthMap& map,
                                    const SurfacePlace& place) {
  const TrainingView& view = data.views[static_cast<std::size_t>(map.view)];
  const Eigen::Vector3d p = view.cam_from_world * place.world;
  if (!confirms(map, p) || !lens_holds(view.camera, p)) return std::nullopt;
  const Eigen::Vector3d normal = view.cam_from_world.rotation * place.normal;
  const double facing = std::abs(normal.dot(p.normalized()));
  if (facing < least_facing) return std::nullopt;
  const Eigen::Vector2d pixel = view.camera.project(p);
  const auto kelvin = even_sample(view.image, pixel, edge_k);
  if (!kelvin) return std::nullopt;
  const double away = 1 - facing;
  return ShadedSample{
      map.view, *kelvin, {shading_r2(pixel.x(), pixel.y(), view.image.size()), away, away * away}};
}

std::vector<ShadedPoint> sights_of(const Dataset& data, const std::vector<DepthMap>& depth) {
  double pixels = 0;
  for (const DepthMap& map : depth) pixels += static_cast<double>(map.depth.total());
  const int step =
      std::max(least_step_px, static_cast<int>(std::ceil(std::sqrt(pixels / most_places))));
  const std::size_t asked = std::min(depth.size(), most_views);
  std::vector<ShadedPoint> sights;
  for (std::size_t own = 0; own < depth.size(); ++own) {
    const DepthMap& map = depth[own];
    const Rigid3d world_from_cam =
        data.views[static_cast<std::size_t>(map.view)].cam_from_world.inverse();
    for (int y = 1; y + 1 < map.depth.rows; y += step)
      for (int x = 1; x + 1 < map.depth.cols; x += step) {
        const auto place = place_at(map, world_from_cam, x, y);
        if (!place) continue;
        ShadedPoint sight;
        for (std::size_t k = 0; k < asked; ++k)
          if (const auto sample =
                  seen_by(data, depth[(own + k * depth.size() / asked) % depth.size()], *place))
            sight.push_back(*sample);
        if (sight.size() > 1) sights.push_back(std::move(sight));
      }
  }
  return sights;
}

/// Weighted means over a sight: what its point's own temperature takes out of the equations.
struct ShadedMeans {
  double weight = 0, kelvin = 0;
  Causes by = Causes::Zero();
};

/// The falloff, without the views of group `left_out` (-1: with all). Points are eliminated, so
/// each turn solves a system of the views' drifts and the causes.
class ShadingFit {
 public:
  ShadingFit(const std::vector<ShadedPoint>& sights, int views, int left_out) : views_(views) {
    for (const ShadedPoint& sight : sights) {
      ShadedPoint used;
      for (const ShadedSample& s : sight)
        if (left_out < 0 || s.view % groups != left_out) used.push_back(s);
      if (used.size() > 1) sights_.push_back(std::move(used));
    }
  }

  double falloff_k() {
    constexpr int turns = 10;
    for (int turn = 0; turn < turns; ++turn) {
      solve();
      weigh();
    }
    return solution_[views_];  // the first of the causes
  }

  /// Share of the falloff's variation that neither drift nor angle could stand for.
  double alone() const { return alone_; }

 private:
  static ShadedMeans means_of(const ShadedPoint& sight) {
    ShadedMeans m;
    for (const ShadedSample& s : sight) m.weight += s.weight;
    for (const ShadedSample& s : sight) {
      m.kelvin += s.weight / m.weight * s.kelvin;
      m.by += s.weight / m.weight * s.by;
    }
    return m;
  }

  void solve() {
    // Parts of the orbit that nothing ties together each drift by zero in the mean; causes that
    // nothing tells stay zero.
    constexpr double prior = 1e-2;
    const int size = views_ + causes;
    Eigen::MatrixXd normal = prior * Eigen::MatrixXd::Identity(size, size);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
    for (const ShadedPoint& sight : sights_) {
      const ShadedMeans mean = means_of(sight);
      for (const ShadedSample& s : sight) {
        const double kelvin = s.weight * (s.kelvin - mean.kelvin);
        const Causes by = s.by - mean.by;
        right[s.view] += kelvin;
        right.tail<causes>() += kelvin * by;
        normal(s.view, s.view) += s.weight;
        normal.bottomRightCorner<causes, causes>() += s.weight * by * by.transpose();
        normal.col(s.view).tail<causes>() += s.weight * by;
        normal.row(s.view).tail<causes>() += s.weight * by.transpose();
        for (const ShadedSample& o : sight)
          normal(s.view, o.view) -= s.weight * o.weight / mean.weight;
      }
    }
    const Eigen::LDLT<Eigen::MatrixXd> solver = normal.ldlt();
    solution_ = solver.solve(right);
    const Eigen::VectorXd answer = solver.solve(Eigen::VectorXd::Unit(size, views_));
    alone_ = 1 / (normal(views_, views_) * answer[views_]);
  }

  double own_of(const ShadedSample& s) const {
    return s.kelvin - solution_[s.view] - solution_.tail<causes>().dot(s.by);
  }

  void weigh() {
    std::vector<double> sizes;
    std::vector<double> of_points;
    for (const ShadedPoint& sight : sights_) {
      double weight = 0, sum = 0;
      for (const ShadedSample& s : sight) {
        weight += s.weight;
        sum += s.weight * own_of(s);
      }
      of_points.push_back(sum / weight);
      for (const ShadedSample& s : sight) sizes.push_back(std::abs(own_of(s) - of_points.back()));
    }
    const double typical = std::max(least_residual_k, 1.5 * median(sizes));
    auto size = sizes.begin();
    for (ShadedPoint& sight : sights_)
      for (ShadedSample& s : sight) s.weight = std::pow(typical / std::max(typical, *size++), 2);
  }

  int views_;
  double alone_ = 0;
  std::vector<ShadedPoint> sights_;
  Eigen::VectorXd solution_;
};

}  // namespace

bool Shading::told() const {
  const double size = std::abs(falloff_k);
  return alone > least_alone && size > least_k && size > sure * sigma_k && size < largest_k;
}

Shading estimate_shading(const Dataset& dataset, const std::vector<DepthMap>& depth) {
  Shading shading;
  const std::vector<ShadedPoint> sights = sights_of(dataset, depth);
  shading.points = static_cast<int>(sights.size());
  if (shading.points < least_points) return shading;
  const auto views = static_cast<int>(dataset.views.size());
  ShadingFit fit(sights, views, -1);
  shading.falloff_k = fit.falloff_k();
  shading.alone = fit.alone();
  std::vector<double> without;
  double mean = 0, squares = 0;
  for (int g = 0; g < groups; ++g) {
    without.push_back(ShadingFit(sights, views, g).falloff_k());
    mean += without.back() / groups;
  }
  for (const double one : without) squares += (one - mean) * (one - mean);
  shading.sigma_k = std::sqrt(squares * (groups - 1) / groups);
  return shading;
}

}  // namespace orbitfuse::nerf
