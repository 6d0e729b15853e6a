// SPDX-License-Identifier: BSD-3-Clause
#include "recon/alignment/pose_bundle.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/system/parallel.hpp"
#include "recon/alignment/patch_residual.hpp"
#include "recon/alignment/trust_region.hpp"

namespace orbitfuse {
namespace {

using Vector8d = Eigen::Matrix<double, 8, 1>;
using Matrix8d = Eigen::Matrix<double, 8, 8>;

/// Places are summed in so many parts, whatever the number of threads.
constexpr std::size_t parts = 8;

/// Two residuals, by a view's correction, the lens (log_focal, radial) and a place's offset.
struct LinearPair {
  Eigen::Matrix<double, 2, 6> by_correction;
  Eigen::Matrix2d by_lens;
  Eigen::Matrix<double, 2, 3> by_offset;
  Eigen::Vector2d residual;
};

LinearPair weighted(const CorrectedPixel& seen, const Eigen::Vector2d& found,
                    const Eigen::Matrix2d& weight) {
  LinearPair pair;
  pair.by_correction = weight * seen.by_correction;
  pair.by_lens << weight * seen.by_log_focal, weight * seen.by_radial;
  pair.by_offset = weight * seen.by_point;
  pair.residual = weight * (seen.pixel - found);
  return pair;
}

void scale(LinearPair& pair, double by) {
  pair.by_correction *= by, pair.by_lens *= by, pair.by_offset *= by, pair.residual *= by;
}

/// A view's own part of the normal equations: its correction and the lens.
struct ViewPart {
  Matrix8d h = Matrix8d::Zero();
  Vector8d g = Vector8d::Zero();

  void add(const LinearPair& pair) {
    Eigen::Matrix<double, 2, 8> j;
    j << pair.by_correction, pair.by_lens;
    h.noalias() += j.transpose() * j;
    g.noalias() += j.transpose() * pair.residual;
  }
  void add(const ViewPart& other) { h += other.h, g += other.g; }
};

std::size_t first_of(std::size_t part, std::size_t count) { return count * part / parts; }

}  // namespace

/// A place's own part of the normal equations, and its sightings.
struct PoseBundle::LinearPlace {
  std::vector<LinearPair> sightings;
  Eigen::Matrix3d h = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
};

struct PoseBundle::Linear {
  std::vector<ViewPart> views;  ///< of what each view sees, places included
  Eigen::Matrix2d lens_h = Eigen::Matrix2d::Zero();
  Eigen::Vector2d lens_g = Eigen::Vector2d::Zero();  ///< of the priors
  std::array<bool, 2> lens_free{};
  std::vector<LinearPlace> places;
  double cost = 0;
};

struct PoseBundle::Step {
  Eigen::VectorXd shared;  ///< six of each view, two of the lens
  std::vector<Eigen::Vector3d> offsets;
  double predicted = 0;  ///< gain of the linear problem; not positive: no step was found
  double squared_length = 0;
};

PoseBundle::PoseBundle(const Camera& camera, std::size_t views)
    : camera_(camera), held_(views, false), matches_(views) {
  state_.corrections.resize(views, PoseCorrection{});
}

void PoseBundle::add(std::size_t view, const PatchMatch& match, double weight) {
  matches_[view].push_back({match, weight});
}

void PoseBundle::add(SharedPlace place) {
  places_.push_back(std::move(place));
  state_.offsets.push_back(Eigen::Vector3d::Zero());
}

bool PoseBundle::linearise(const State& at, const CommonLensPrior& lens,
                           const PoseBundleLosses& losses, Linear& linear) const {
  const std::size_t views = matches_.size();
  std::vector<CorrectedPose> poses;
  for (const PoseCorrection& correction : at.corrections) poses.emplace_back(correction);
  const auto seen = [&](std::size_t view, const Eigen::Vector3d& point) {
    return corrected_pixel(camera_, poses[view], at.lens[0], at.lens[1], point);
  };
  linear.views.assign(views, {});
  std::vector<double> costs(views + parts, 0);
  parallel_for(static_cast<int>(views), [&](int index) {
    const auto v = static_cast<std::size_t>(index);
    for (const auto& [match, weight] : matches_[v]) {
      const auto pixel = seen(v, match.point);
      if (!pixel) {
        costs[v] = std::numeric_limits<double>::infinity();
        return;
      }
      LinearPair pair = weighted(*pixel, match.seen, match.sqrt_weight);
      const Cauchy loss(pair.residual.squaredNorm(), losses.edge_px);
      costs[v] += weight * loss.cost;
      scale(pair, std::sqrt(weight) * loss.root);
      linear.views[v].add(pair);
    }
  });
  linear.places.assign(places_.size(), {});
  std::vector<std::vector<ViewPart>> sums(parts, std::vector<ViewPart>(views));
  parallel_for(parts, [&](int index) {
    const auto part = static_cast<std::size_t>(index);
    double& cost = costs[views + part];
    for (std::size_t p = first_of(part, places_.size()); p < first_of(part + 1, places_.size());
         ++p) {
      const SharedPlace& place = places_[p];
      LinearPlace& out = linear.places[p];
      const Eigen::Vector3d& offset = at.offsets[p];
      const double along = offset.dot(place.sight) / place.sigma;
      const Cauchy hold(along * along, 1);
      cost += hold.cost;
      const Eigen::Vector3d by_offset = hold.root / place.sigma * place.sight;
      out.h = by_offset * by_offset.transpose();
      out.g = hold.root * along * by_offset;
      for (const SharedPlace::Sighting& sighting : place.sightings) {
        const auto pixel = seen(sighting.view, sighting.point + sighting.cam_from_world * offset);
        if (!pixel) {
          cost = std::numeric_limits<double>::infinity();
          return;
        }
        LinearPair pair = weighted(*pixel, sighting.pixel, sighting.sqrt_weight);
        pair.by_offset *= sighting.cam_from_world;
        const Cauchy loss(pair.residual.squaredNorm(), losses.sighting_px);
        cost += loss.cost;
        scale(pair, loss.root);
        sums[part][sighting.view].add(pair);
        out.h.noalias() += pair.by_offset.transpose() * pair.by_offset;
        out.g.noalias() += pair.by_offset.transpose() * pair.residual;
        out.sightings.push_back(pair);
      }
    }
  });
  for (const auto& part : sums)
    for (std::size_t v = 0; v < views; ++v) linear.views[v].add(part[v]);
  linear.cost = 0;
  for (const double cost : costs) linear.cost += cost / 2;
  linear.lens_h.setZero(), linear.lens_g.setZero();
  const std::array<ValuePrior, 2> priors{lens.log_focal, lens.radial};
  for (std::size_t k = 0; k < 2; ++k) {
    linear.lens_free[k] = priors[k].sigma > 0;
    if (!linear.lens_free[k]) continue;
    const auto i = static_cast<Eigen::Index>(k);
    const double off = (at.lens[k] - priors[k].mean) / priors[k].sigma;
    linear.cost += off * off / 2;
    linear.lens_h(i, i) = 1 / (priors[k].sigma * priors[k].sigma);
    linear.lens_g(i) = off / priors[k].sigma;
  }
  return std::isfinite(linear.cost);
}

/// The normal equations of what views share, damped.
struct PoseBundle::Reduced {
  Eigen::MatrixXd h;                           ///< its lower triangle
  Eigen::VectorXd g, damped;                   ///< gradient; what was added to the diagonal
  std::vector<Eigen::Matrix3d> inverse;        ///< of each place's own part
  std::vector<Eigen::Vector3d> place_damping;  ///< what was added to its diagonal

  static Eigen::Index of_view(std::size_t v) { return static_cast<Eigen::Index>(6 * v); }
  Eigen::Index of_lens() const { return g.size() - 2; }
  /// So many parameters don't move.
  void hold(Eigen::Index first, Eigen::Index count) {
    h.middleRows(first, count).setZero(), h.middleCols(first, count).setZero();
    h.diagonal().segment(first, count).setOnes(), g.segment(first, count).setZero();
  }
};

PoseBundle::Reduced PoseBundle::views_alone(const Linear& linear, double radius) const {
  Reduced out;
  const Eigen::Index lens_at = Reduced::of_view(matches_.size()), size = lens_at + 2;
  out.h = Eigen::MatrixXd::Zero(size, size);
  out.g = Eigen::VectorXd::Zero(size);
  out.h.block<2, 2>(lens_at, lens_at) = linear.lens_h;
  out.g.tail<2>() = linear.lens_g;
  for (std::size_t v = 0; v < matches_.size(); ++v) {
    const Eigen::Index at = Reduced::of_view(v);
    const ViewPart& part = linear.views[v];
    out.h.block<6, 6>(at, at) = part.h.topLeftCorner<6, 6>();
    out.h.block<2, 6>(lens_at, at) = part.h.bottomLeftCorner<2, 6>();
    out.h.block<2, 2>(lens_at, lens_at) += part.h.bottomRightCorner<2, 2>();
    out.g.segment<6>(at) = part.g.head<6>();
    out.g.tail<2>() += part.g.tail<2>();
  }
  out.damped.resize(size);
  for (Eigen::Index i = 0; i < size; ++i) out.damped(i) = damping(out.h(i, i), radius);
  out.h.diagonal() += out.damped;
  return out;
}

/// Takes a place out: what is left is what the views that show it, and the lens, say of each other.
void PoseBundle::eliminate(std::size_t index, const LinearPlace& place, const Reduced& reduced,
                           Eigen::MatrixXd& h, Eigen::VectorXd& g) const {
  const auto& sightings = places_[index].sightings;
  const Eigen::Matrix3d& inverse = reduced.inverse[index];
  const Eigen::Index lens_at = reduced.of_lens();
  std::vector<Eigen::Matrix<double, 6, 3>> by_view, gained;
  Eigen::Matrix<double, 2, 3> by_lens = Eigen::Matrix<double, 2, 3>::Zero();
  for (const LinearPair& pair : place.sightings) {
    by_view.emplace_back(pair.by_correction.transpose() * pair.by_offset);
    gained.emplace_back(by_view.back() * inverse);
    by_lens.noalias() += pair.by_lens.transpose() * pair.by_offset;
  }
  const Eigen::Matrix<double, 2, 3> lens_gained = by_lens * inverse;
  for (std::size_t a = 0; a < sightings.size(); ++a) {
    const Eigen::Index row = Reduced::of_view(sightings[a].view);
    for (std::size_t b = 0; b < sightings.size(); ++b)
      if (sightings[b].view <= sightings[a].view)  // the lower triangle
        h.block<6, 6>(row, Reduced::of_view(sightings[b].view)).noalias() -=
            gained[a] * by_view[b].transpose();
    h.block<2, 6>(lens_at, row).noalias() -= lens_gained * by_view[a].transpose();
    g.segment<6>(row).noalias() -= gained[a] * place.g;
  }
  h.block<2, 2>(lens_at, lens_at).noalias() -= lens_gained * by_lens.transpose();
  g.tail<2>().noalias() -= lens_gained * place.g;
}

void PoseBundle::eliminate_places(const Linear& linear, double radius, Reduced& reduced) const {
  reduced.inverse.resize(places_.size());
  reduced.place_damping.resize(places_.size());
  std::vector<Eigen::MatrixXd> h(parts);
  std::vector<Eigen::VectorXd> g(parts);
  parallel_for(parts, [&](int index) {
    const auto part = static_cast<std::size_t>(index);
    const auto begin = first_of(part, places_.size()), end = first_of(part + 1, places_.size());
    if (begin == end) return;
    h[part] = Eigen::MatrixXd::Zero(reduced.h.rows(), reduced.h.cols());
    g[part] = Eigen::VectorXd::Zero(reduced.g.size());
    for (std::size_t i = begin; i < end; ++i) {
      Eigen::Matrix3d own = linear.places[i].h;
      for (Eigen::Index k = 0; k < 3; ++k) reduced.place_damping[i](k) = damping(own(k, k), radius);
      own.diagonal() += reduced.place_damping[i];
      reduced.inverse[i] = own.inverse();
      eliminate(i, linear.places[i], reduced, h[part], g[part]);
    }
  });
  for (std::size_t part = 0; part < parts; ++part) {
    if (h[part].size() == 0) continue;
    reduced.h += h[part];
    reduced.g += g[part];
  }
}

PoseBundle::Step PoseBundle::step(const Linear& linear, double radius) const {
  Reduced reduced = views_alone(linear, radius);
  const Eigen::VectorXd gradient = reduced.g;
  eliminate_places(linear, radius, reduced);
  for (std::size_t v = 0; v < held_.size(); ++v)
    if (held_[v]) reduced.hold(Reduced::of_view(v), 6);
  for (std::size_t k = 0; k < 2; ++k)
    if (!linear.lens_free[k]) reduced.hold(reduced.of_lens() + static_cast<Eigen::Index>(k), 1);
  Step found;
  const Eigen::LLT<Eigen::MatrixXd> factors(reduced.h);  // reads the lower triangle
  if (factors.info() != Eigen::Success) return found;
  found.shared = -factors.solve(reduced.g);
  // The linear problem's gain: half of the step along the gradient, and what damping held back.
  double twice = -gradient.dot(found.shared) + found.shared.cwiseAbs2().dot(reduced.damped);
  found.offsets.resize(places_.size());
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const LinearPlace& place = linear.places[i];
    Eigen::Vector3d pull = place.g;
    for (std::size_t s = 0; s < place.sightings.size(); ++s) {
      const LinearPair& pair = place.sightings[s];
      const Eigen::Index at = Reduced::of_view(places_[i].sightings[s].view);
      const Eigen::Vector2d moved =
          pair.by_correction * found.shared.segment<6>(at) + pair.by_lens * found.shared.tail<2>();
      pull += pair.by_offset.transpose() * moved;
    }
    found.offsets[i] = -reduced.inverse[i] * pull;
    twice +=
        -place.g.dot(found.offsets[i]) + found.offsets[i].cwiseAbs2().dot(reduced.place_damping[i]);
  }
  found.squared_length = found.shared.squaredNorm();
  for (const Eigen::Vector3d& offset : found.offsets) found.squared_length += offset.squaredNorm();
  found.predicted = std::isfinite(twice) ? twice / 2 : 0;
  return found;
}

PoseBundle::State PoseBundle::moved(const State& from, const Step& step) const {
  State to = from;
  for (std::size_t v = 0; v < to.corrections.size(); ++v)
    for (std::size_t k = 0; k < 6; ++k)
      to.corrections[v][k] += step.shared(static_cast<Eigen::Index>(6 * v + k));
  const Eigen::Vector2d lens = step.shared.tail<2>();
  to.lens[0] += lens[0], to.lens[1] += lens[1];
  for (std::size_t i = 0; i < to.offsets.size(); ++i) to.offsets[i] += step.offsets[i];
  return to;
}

/// One solve, as minimise() wants it.
struct PoseBundle::Problem {
  using State = PoseBundle::State;
  using Linear = PoseBundle::Linear;
  using Step = PoseBundle::Step;
  const PoseBundle& bundle;
  const CommonLensPrior& lens;
  const PoseBundleLosses& losses;

  bool linearise(const State& at, Linear& linear) const {
    return bundle.linearise(at, lens, losses, linear);
  }
  Step step(const Linear& linear, double radius) const { return bundle.step(linear, radius); }
  State moved(const State& from, const Step& by) const { return bundle.moved(from, by); }
  double squared_norm(const State& at) const {
    double sum = at.lens[0] * at.lens[0] + at.lens[1] * at.lens[1];
    for (const PoseCorrection& c : at.corrections)
      for (const double value : c) sum += value * value;
    for (const Eigen::Vector3d& offset : at.offsets) sum += offset.squaredNorm();
    return sum;
  }
};

bool PoseBundle::solve(const CommonLensPrior& lens, const PoseBundleLosses& losses,
                       int max_iterations) {
  return minimise(Problem{*this, lens, losses}, state_, {.max_iterations = max_iterations}).usable;
}

std::vector<std::vector<double>> PoseBundle::sighting_residuals_px() const {
  std::vector<std::vector<double>> residuals;
  std::vector<CorrectedPose> poses;
  for (const PoseCorrection& correction : state_.corrections) poses.emplace_back(correction);
  for (std::size_t i = 0; i < places_.size(); ++i) {
    residuals.emplace_back();
    for (const SharedPlace::Sighting& s : places_[i].sightings) {
      const auto seen = corrected_pixel(camera_, poses[s.view], log_focal(), radial(),
                                        s.point + s.cam_from_world * state_.offsets[i]);
      residuals.back().push_back(seen ? (s.sqrt_weight * (seen->pixel - s.pixel)).norm()
                                      : std::numeric_limits<double>::quiet_NaN());
    }
  }
  return residuals;
}

}  // namespace orbitfuse
