// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/gray_curves.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/image/samples.hpp"
#include "core/numeric/median.hpp"
#include "recon/nerf/training/gray_sights.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr std::size_t curve_knots = std::tuple_size_v<GrayCurve>;
constexpr double gray_levels = 255, knot_step = gray_levels / (curve_knots - 1);
constexpr std::size_t least_sights = 300;
constexpr std::size_t least_samples = 100;  ///< of a view, for its curve to say something

double level_of(std::size_t knot) { return knot_step * static_cast<double>(knot); }

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

/// The nearest curve that rises, by least squares (pool adjacent violators).
void make_rise(GrayCurve& curve, const GrayCurve& weights) {
  struct Pool {
    double value, weight;
    std::size_t knots;
  };
  std::vector<Pool> pools;
  for (std::size_t k = 0; k < curve_knots; ++k) {
    pools.push_back({curve[k], weights[k], 1});
    while (pools.size() > 1 && pools[pools.size() - 2].value > pools.back().value) {
      const Pool last = pools.back();
      pools.pop_back();
      Pool& pool = pools.back();
      pool.value =
          (pool.weight * pool.value + last.weight * last.value) / (pool.weight + last.weight);
      pool.weight += last.weight;
      pool.knots += last.knots;
    }
  }
  std::size_t k = 0;
  for (const Pool& pool : pools)
    for (std::size_t i = 0; i < pool.knots; ++i) curve[k++] = pool.value;
}

/// How the levels that two views have of the same points go together.
struct Together {
  double n = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0;
  void add(double own, double other) {
    ++n, x += own, y += other;
    xx += own * own, yy += other * other, xy += own * other;
  }
  double variance_own() const { return n > 0 ? std::max(0.0, xx - x * x / n) : 0; }
  double variance_other() const { return n > 0 ? std::max(0.0, yy - y * y / n) : 0; }
  double covariance() const { return n > 0 ? xy - x * y / n : 0; }
};

/// How each view's levels go with every other's, about the means of what the two share: a view
/// whose levels lie higher as a whole (a camera that drifts) says nothing of which way they rise.
class Agreements {
 public:
  Agreements(const std::vector<LevelSight>& seen, const std::vector<LevelSight>& by_heldout,
             std::size_t views)
      : views_(views), pairs_(views * views), samples_(views) {
    for (std::size_t p = 0; p < seen.size(); ++p)
      for (const auto* own : {&seen[p], &by_heldout[p]})
        for (const LevelSample& s : *own) {
          const auto view = static_cast<std::size_t>(s.view);
          ++samples_[view];
          for (const LevelSample& o : seen[p])
            if (o.view != s.view)
              pairs_[view * views_ + static_cast<std::size_t>(o.view)].add(s.level, o.level);
        }
  }

  /// Its levels fall where the others' rise, some of which are turned (right views of `van`, every
  /// fourth inverted: .30 and more; inverted ones, while others were: -.38 and less).
  bool against(std::size_t view, const std::vector<bool>& turned) const {
    return correlation(view, turned) < -0.2;
  }
  /// 0 where too few tell.
  double correlation(std::size_t view, const std::vector<bool>& turned) const {
    if (samples_[view] < least_samples) return 0;
    double own = 0, other = 0, both = 0;
    for (std::size_t o = 0; o < views_; ++o) {
      const Together& pair = pairs_[view * views_ + o];
      own += pair.variance_own();
      other += pair.variance_other();
      both += (turned[view] == turned[o] ? 1 : -1) * pair.covariance();
    }
    return own * other > 0 ? both / std::sqrt(own * other) : 0;
  }
  /// Of all pairs.
  double correlation() const {
    double own = 0, other = 0, both = 0;
    for (const Together& pair : pairs_)
      own += pair.variance_own(), other += pair.variance_other(), both += pair.covariance();
    return own * other > 0 ? both / std::sqrt(own * other) : 0;
  }

 private:
  std::size_t views_;
  std::vector<Together> pairs_;  ///< [view * views_ + other that trains]
  std::vector<std::size_t> samples_;
};

/// Points are eliminated, so each turn solves a system of the curves alone.
class CurveFit {
 public:
  CurveFit(LevelSights sights, const std::vector<bool>& heldout)
      : sights_(std::move(sights.seen)),
        by_heldout_(std::move(sights.by_heldout)),
        heldout_(heldout),
        reversed_(heldout.size()),
        samples_(heldout.size()),
        near_knot_(heldout.size()),
        curves_(heldout.size()) {
    for (GrayCurve& curve : curves_)
      for (std::size_t k = 0; k < curve_knots; ++k) curve[k] = level_of(k);
    before_ = weigh();
    turn_reversed();
    for (GrayCurve& knots : near_knot_) knots.fill(1e-3);
    for (const auto* list : {&sights_, &by_heldout_})
      for (const LevelSight& sight : *list)
        for (const LevelSample& s : sight) {
          const KnotPair at = knots_round(s.level);
          const auto view = static_cast<std::size_t>(s.view);
          near_knot_[view][at.knot] += 1 - at.above;
          near_knot_[view][at.knot + 1] += at.above;
          ++samples_[view];
        }
  }

  void run() {
    constexpr int turns = 8;
    for (int turn = 0; turn < turns; ++turn) {
      solve();
      left_ = weigh();
    }
    for (std::size_t v = 0; v < curves_.size(); ++v)
      if (heldout_[v]) follow(v);
  }

  /// Of the levels as the views store them.
  std::vector<GrayCurve> curves() const {
    std::vector<GrayCurve> stored = curves_;
    for (std::size_t v = 0; v < stored.size(); ++v)
      if (reversed_[v]) std::reverse(stored[v].begin(), stored[v].end());
    return stored;
  }
  std::vector<std::size_t> reversed() const {
    return views_where([&](std::size_t v) { return static_cast<bool>(reversed_[v]); });
  }
  std::vector<std::size_t> alone() const {
    return views_where([&](std::size_t v) { return samples_[v] < least_samples; });
  }
  double before() const { return before_; }
  double left() const { return left_; }

  double variety() const {
    std::vector<double> levels;
    for (const LevelSight& sight : sights_) levels.push_back(own_of(sight));
    const double middle = median(levels);
    for (double& level : levels) level = std::abs(level - middle);
    return median(levels);
  }

  /// Regression of common levels on the views' own, about each view's means.
  double slope() const {
    std::vector<Together> views(curves_.size());
    for (const LevelSight& sight : sights_)
      for (const LevelSample& s : sight)
        views[static_cast<std::size_t>(s.view)].add(s.level, common_level(curve_of(s), s.level));
    double covariance = 0, variance = 0;
    for (const Together& view : views)
      covariance += view.covariance(), variance += view.variance_own();
    return variance > 0 ? covariance / variance : 1;
  }

  /// Of the common levels of views that train.
  double agreement() const {
    std::vector<LevelSight> common = sights_;
    for (LevelSight& sight : common)
      for (LevelSample& s : sight) s.level = common_level(curve_of(s), s.level);
    return Agreements(common, std::vector<LevelSight>(common.size()), curves_.size()).correlation();
  }

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

  template <class Asked>
  std::vector<std::size_t> views_where(const Asked& asked) const {
    std::vector<std::size_t> views;
    for (std::size_t v = 0; v < curves_.size(); ++v)
      if (asked(v)) views.push_back(v);
    return views;
  }

  void turn(std::size_t view) {
    reversed_[view] = !reversed_[view];
    for (auto* list : {&sights_, &by_heldout_})
      for (LevelSight& sight : *list)
        for (LevelSample& s : sight)
          if (static_cast<std::size_t>(s.view) == view) s.level = gray_levels - s.level;
  }

  /// One after the other, the one that is most against the rest first: a second one makes the rest
  /// less sure. From here on all levels rise together.
  void turn_reversed() {
    const Agreements agreements(sights_, by_heldout_, heldout_.size());
    const auto views =
        static_cast<std::size_t>(std::count(heldout_.begin(), heldout_.end(), false));
    for (std::size_t turned = 0; 2 * (turned + 1) < views; ++turned) {
      std::optional<std::size_t> most;
      for (std::size_t v = 0; v < heldout_.size(); ++v)
        if (!heldout_[v] && !reversed_[v] && agreements.against(v, reversed_) &&
            (!most ||
             agreements.correlation(v, reversed_) < agreements.correlation(*most, reversed_)))
          most = v;
      if (!most) break;
      turn(*most);
    }
    for (std::size_t v = 0; v < heldout_.size(); ++v)
      if (heldout_[v] && agreements.against(v, reversed_)) turn(v);
    weigh();
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
    const Eigen::VectorXd solution = normal.llt().solve(right);
    for (std::size_t k = 0; k < curve_knots; ++k)
      curves_[view][k] = solution[static_cast<Eigen::Index>(k)];
    make_rise(curves_[view], near_knot_[view]);
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
    const Eigen::VectorXd solution = normal.llt().solve(right);
    for (std::size_t i = 0; i < curves_.size() * curve_knots; ++i)
      curves_[i / curve_knots][i % curve_knots] = solution[static_cast<Eigen::Index>(i)];
    for (std::size_t v = 0; v < curves_.size(); ++v) make_rise(curves_[v], near_knot_[v]);
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
  std::vector<bool> heldout_, reversed_;
  std::vector<std::size_t> samples_;  ///< of each view
  std::vector<GrayCurve> near_knot_;  ///< of these, at each knot
  std::vector<GrayCurve> curves_;     ///< of levels that rise in all views
  double before_ = 0, left_ = 0;
};

/// All together so that what the training images show, but for a thousandth at either end, fills
/// 0..255.
void stretch(std::vector<GrayCurve>& curves, const Dataset& data,
             const std::vector<bool>& heldout) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (std::size_t v = 0; v < curves.size(); ++v) {
    std::vector<float> levels;
    if (!heldout[v]) append_finite(data.views[v].image, levels);
    if (levels.empty()) continue;
    std::sort(levels.begin(), levels.end());
    const std::size_t rare = levels.size() / 1000;
    for (const float level : {levels[rare], levels[levels.size() - 1 - rare]}) {
      const double common = common_level(curves[v], static_cast<double>(level));
      low = std::min(low, common);
      high = std::max(high, common);
    }
  }
  if (!(high > low)) return;
  for (GrayCurve& curve : curves)
    for (double& value : curve) value = gray_levels * (value - low) / (high - low);
}

}  // namespace

bool GrayCurves::told() const {
  constexpr double least_spread = 6;  // levels
  return !of_view.empty() && !flattened() &&
         (training_reversed || (spread > least_spread && left < 0.8 * before));
}

bool GrayCurves::flattened() const { return slope < 0.5 && agreement < 0.7; }

bool GrayCurves::contradict() const {
  constexpr double noise = 4;  // levels
  return !of_view.empty() && left > std::max(noise, 0.35 * variety);
}

GrayCurves estimate_gray_curves(const Dataset& dataset, const std::vector<DepthMap>& depth,
                                const std::vector<bool>& heldout) {
  GrayCurves found;
  LevelSights sights = level_sights(dataset, depth, heldout);
  found.points = static_cast<int>(sights.seen.size());
  if (sights.seen.size() < least_sights) return found;
  CurveFit fit(std::move(sights), heldout);
  fit.run();
  found.before = fit.before();
  found.left = fit.left();
  found.spread = fit.spread();
  found.variety = fit.variety();
  found.slope = fit.slope();
  found.agreement = fit.agreement();
  found.reversed = fit.reversed();
  found.training_reversed = std::any_of(found.reversed.begin(), found.reversed.end(),
                                        [&](std::size_t view) { return !heldout[view]; });
  found.alone = fit.alone();
  found.of_view = fit.curves();
  stretch(found.of_view, dataset, heldout);
  return found;
}

cv::Mat to_common_levels(const cv::Mat& image, const GrayCurve& curve) {
  cv::Mat common = image.clone();
  for (float& v : cv::Mat_<float>(common))
    if (std::isfinite(v))
      v = static_cast<float>(
          std::clamp(common_level(curve, static_cast<double>(v)), 0.0, gray_levels));
  return common;
}

}  // namespace orbitfuse::nerf
