// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/gray_curves.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/geometry/lens_fold.hpp"
#include "core/geometry/lifted.hpp"
#include "core/numeric/median.hpp"
#include "recon/nerf/training/confirms.hpp"
#include "recon/nerf/training/even_sample.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr std::size_t curve_knots = std::tuple_size_v<GrayCurve>;
constexpr double gray_levels = 255, knot_step = gray_levels / (curve_knots - 1);
constexpr double least_gray = 2, most_gray = 253;  ///< beyond, a camera clipped what it saw
constexpr float gray_edge = 40;                    ///< range of 5x5 pixels: beyond, poses decide
constexpr int sight_step_px = 3;                   ///< between the points of a depth map
constexpr std::size_t most_askers = 24;            ///< asked for a place, spread over the orbit
constexpr int least_sights = 300;

double level_of(std::size_t knot) { return knot_step * static_cast<double>(knot); }

struct LevelSample {
  int view;
  double level, weight = 1;
};
using LevelSight = std::vector<LevelSample>;

/// None where the camera clipped, either.
std::optional<double> level_at(const cv::Mat& image, const Eigen::Vector2d& pixel) {
  const auto level = even_sample(image, pixel, gray_edge);
  return level && *level > least_gray && *level < most_gray ? level : std::nullopt;
}

/// Where views that train see a point of one of their maps, and what of it views held out see.
struct LevelSights {
  std::vector<LevelSight> seen, by_heldout;
};

LevelSights level_sights(const Dataset& data, const std::vector<DepthMap>& depth,
                         const std::vector<bool>& heldout) {
  const auto trains = [&](const DepthMap& map) {
    return !heldout[static_cast<std::size_t>(map.view)];
  };
  const std::size_t asked = std::min(depth.size(), most_askers);
  LevelSights sights;
  for (std::size_t own = 0; own < depth.size(); ++own) {
    const DepthMap& map = depth[own];
    if (!trains(map)) continue;
    const Rigid3d world_from_cam =
        data.views[static_cast<std::size_t>(map.view)].cam_from_world.inverse();
    for (int y = 1; y + 1 < map.depth.rows; y += sight_step_px)
      for (int x = 1; x + 1 < map.depth.cols; x += sight_step_px) {
        if (!std::isfinite(map.depth.at<float>(y, x))) continue;
        const Eigen::Vector3d world = world_from_cam * lifted(map.depth, map.camera, x, y);
        LevelSight sight, apart;
        for (std::size_t k = 0; k < asked; ++k) {
          const DepthMap& other = depth[(own + k * depth.size() / asked) % depth.size()];
          const TrainingView& view = data.views[static_cast<std::size_t>(other.view)];
          const Eigen::Vector3d p = view.cam_from_world * world;
          if (!confirms(other, p) || !lens_holds(view.camera, p)) continue;
          if (const auto level = level_at(view.image, view.camera.project(p)))
            (trains(other) ? sight : apart).push_back({other.view, *level});
        }
        if (sight.size() < 2) continue;
        sights.seen.push_back(std::move(sight));
        sights.by_heldout.push_back(std::move(apart));
      }
  }
  return sights;
}

/// A level between its two knots.
struct KnotPair {
  std::size_t knot;
  double above;  ///< share of the upper one
};

KnotPair knots_round(double level) {
  const double at = std::clamp(level, 0.0, gray_levels) / knot_step;
  const std::size_t knot = std::min(static_cast<std::size_t>(at), curve_knots - 2);
  return {knot, at - static_cast<double>(knot)};
}

double common_level(const GrayCurve& curve, double level) {
  const KnotPair at = knots_round(level);
  return (1 - at.above) * curve[at.knot] + at.above * curve[at.knot + 1];
}

/// Points are eliminated, so each turn solves a system of the curves alone.
class CurveFit {
 public:
  CurveFit(LevelSights sights, const std::vector<bool>& heldout)
      : sights_(std::move(sights.seen)),
        by_heldout_(std::move(sights.by_heldout)),
        heldout_(heldout),
        curves_(heldout.size()) {
    for (GrayCurve& curve : curves_)
      for (std::size_t k = 0; k < curve_knots; ++k) curve[k] = level_of(k);
    before_ = weigh();
  }

  void run() {
    constexpr int turns = 8;
    for (int turn = 0; turn < turns; ++turn) {
      solve();
      left_ = weigh();
    }
    for (std::size_t v = 0; v < curves_.size(); ++v)
      if (heldout_[v]) follow(v);
    for (GrayCurve& curve : curves_)  // a flat part tells nothing, a falling one is noise
      for (std::size_t k = 1; k < curve_knots; ++k)
        curve[k] = std::max(curve[k], curve[k - 1] + 0.02 * knot_step);
  }

  const std::vector<GrayCurve>& curves() const { return curves_; }
  double before() const { return before_; }
  double left() const { return left_; }

  double spread() const {
    double squares = 0, count = 0;
    for (const LevelSight& sight : sights_)
      for (const LevelSample& s : sight) {
        const double moved = common_level(curve_of(s), s.level) - s.level;
        squares += moved * moved, ++count;
      }
    return std::sqrt(squares / std::max(1.0, count));
  }

 private:
  const GrayCurve& curve_of(const LevelSample& s) const {
    return curves_[static_cast<std::size_t>(s.view)];
  }

  /// A curve is smooth, and near the view's own levels where nothing tells.
  static void add_prior(Eigen::Index first, Eigen::MatrixXd& normal, Eigen::VectorXd& right) {
    constexpr double smooth = 20, own = 1e-2;
    for (std::size_t k = 0; k < curve_knots; ++k) {
      const auto i = first + static_cast<Eigen::Index>(k);
      normal(i, i) += own;
      right[i] += own * level_of(k);
      if (k == 0 || k + 1 == curve_knots) continue;
      const Eigen::Vector3d bend(1, -2, 1);
      normal.block<3, 3>(i - 1, i - 1) += smooth * bend * bend.transpose();
    }
  }

  /// Curves of views that train are the identity in their mean.
  void add_mean(Eigen::MatrixXd& normal, Eigen::VectorXd& right) const {
    constexpr double mean = 1e3;
    const auto views = static_cast<double>(std::count(heldout_.begin(), heldout_.end(), false));
    for (std::size_t v = 0; v < curves_.size(); ++v)
      for (std::size_t k = 0; k < curve_knots && !heldout_[v]; ++k) {
        const auto i = static_cast<Eigen::Index>(v * curve_knots + k);
        for (std::size_t w = 0; w < curves_.size(); ++w)
          if (!heldout_[w])
            normal(i, static_cast<Eigen::Index>(w * curve_knots + k)) += mean / views;
        right[i] += mean * level_of(k);
      }
  }

  /// What the point has by the views that train.
  double own_of(const LevelSight& sight) const {
    double total = 0, sum = 0;
    for (const LevelSample& s : sight) {
      total += s.weight;
      sum += s.weight * common_level(curve_of(s), s.level);
    }
    return sum / total;
  }

  /// A view held out has no say, and follows.
  void follow(std::size_t view) {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(curve_knots, curve_knots);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(curve_knots);
    add_prior(0, normal, right);
    for (std::size_t p = 0; p < sights_.size(); ++p)
      for (const LevelSample& s : by_heldout_[p]) {
        if (static_cast<std::size_t>(s.view) != view) continue;
        const KnotPair at = knots_round(s.level);
        const auto i = static_cast<Eigen::Index>(at.knot);
        const Eigen::Vector2d of_s(1 - at.above, at.above);
        normal.block<2, 2>(i, i) += of_s * of_s.transpose();
        right.segment<2>(i) += own_of(sights_[p]) * of_s;
      }
    const Eigen::VectorXd solution = normal.ldlt().solve(right);
    for (std::size_t k = 0; k < curve_knots; ++k)
      curves_[view][k] = solution[static_cast<Eigen::Index>(k)];
  }

  void solve() {
    const auto size = static_cast<Eigen::Index>(curves_.size() * curve_knots);
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
    for (std::size_t v = 0; v < curves_.size(); ++v)
      add_prior(static_cast<Eigen::Index>(v * curve_knots), normal, right);
    add_mean(normal, right);
    for (const LevelSight& sight : sights_) {
      double total = 0;
      for (const LevelSample& s : sight) total += s.weight;
      for (const LevelSample& s : sight)
        for (const LevelSample& o : sight) {
          const double both = (&s == &o ? s.weight : 0) - s.weight * o.weight / total;
          const KnotPair a = knots_round(s.level), b = knots_round(o.level);
          const auto i = static_cast<Eigen::Index>(static_cast<std::size_t>(s.view) * curve_knots +
                                                   a.knot),
                     j = static_cast<Eigen::Index>(static_cast<std::size_t>(o.view) * curve_knots +
                                                   b.knot);
          const Eigen::Vector2d of_s(1 - a.above, a.above), of_o(1 - b.above, b.above);
          normal.block<2, 2>(i, j) += both * of_s * of_o.transpose();
        }
    }
    const Eigen::VectorXd solution = normal.ldlt().solve(right);
    for (std::size_t i = 0; i < curves_.size() * curve_knots; ++i)
      curves_[i / curve_knots][i % curve_knots] = solution[static_cast<Eigen::Index>(i)];
  }

  /// Weights fall with the square of the residual. Returns the median one.
  double weigh() {
    constexpr double least = 2;  // levels: rounding, noise, compression
    std::vector<double> sizes;
    for (const LevelSight& sight : sights_) {
      const double own = own_of(sight);
      for (const LevelSample& s : sight)
        sizes.push_back(std::abs(common_level(curve_of(s), s.level) - own));
    }
    const double middle = median(sizes), typical = std::max(least, 1.5 * middle);
    auto size = sizes.begin();
    for (LevelSight& sight : sights_)
      for (LevelSample& s : sight) s.weight = std::pow(typical / std::max(typical, *size++), 2);
    return middle;
  }

  std::vector<LevelSight> sights_, by_heldout_;
  std::vector<bool> heldout_;
  std::vector<GrayCurve> curves_;
  double before_ = 0, left_ = 0;
};

/// All curves together to 0..255.
std::vector<GrayCurve> stretched(std::vector<GrayCurve> curves) {
  double low = curves[0].front(), high = curves[0].back();
  for (const GrayCurve& curve : curves) {
    low = std::min(low, curve.front());
    high = std::max(high, curve.back());
  }
  for (GrayCurve& curve : curves)
    for (double& value : curve) value = gray_levels * (value - low) / (high - low);
  return curves;
}

}  // namespace

bool GrayCurves::told() const {
  constexpr double least_spread = 6;  // levels
  return !of_view.empty() && spread > least_spread && left < 0.8 * before;
}

GrayCurves estimate_gray_curves(const Dataset& dataset, const std::vector<DepthMap>& depth,
                                const std::vector<bool>& heldout) {
  GrayCurves found;
  LevelSights sights = level_sights(dataset, depth, heldout);
  found.points = static_cast<int>(sights.seen.size());
  if (found.points < least_sights) return found;
  CurveFit fit(std::move(sights), heldout);
  fit.run();
  found.before = fit.before();
  found.left = fit.left();
  found.spread = fit.spread();
  found.of_view = stretched(fit.curves());
  return found;
}

cv::Mat to_common_levels(const cv::Mat& image, const GrayCurve& curve) {
  cv::Mat common = image.clone();
  for (float& v : cv::Mat_<float>(common))
    if (std::isfinite(v)) v = static_cast<float>(common_level(curve, v));
  return common;
}

}  // namespace orbitfuse::nerf
