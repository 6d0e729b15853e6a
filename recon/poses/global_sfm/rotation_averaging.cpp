// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/global_sfm/rotation_averaging.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/rotation_vector.hpp"
#include "core/numeric/angle_units.hpp"
#include "core/numeric/median.hpp"
#include "recon/poses/index.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {
namespace {

using Rotations = std::vector<Eigen::Quaterniond>;

Eigen::Vector3d log_of(Eigen::Quaterniond q) {
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  return sine < 1e-12 ? Eigen::Vector3d(2 * q.vec())
                      : Eigen::Vector3d(2 * std::atan2(sine, q.w()) / sine * q.vec());
}

/// What the pair says less what the rotations say, in the first camera's axes.
Eigen::Vector3d residual(const RelativePose& pair, const Rotations& rotation) {
  return log_of(pair.second_from_first.rotation.conjugate() * rotation[at(pair.second)] *
                rotation[at(pair.first)].conjugate());
}

const RelativePose* best_candidate(const std::vector<RelativePose>& candidates,
                                   const Rotations& rotation) {
  const RelativePose* best = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const RelativePose& candidate : candidates) {
    const double miss = residual(candidate, rotation).norm();
    if (miss < least) least = miss, best = &candidate;
  }
  return best;
}

/// Frames reached along the pairs with most matches; the world is the first frame of each tree.
Rotations along_tree(const PairCandidates& candidates, int count) {
  std::vector<const RelativePose*> edges;
  for (const auto& of_pair : candidates)
    if (!of_pair.empty()) edges.push_back(&of_pair.front());
  std::stable_sort(edges.begin(), edges.end(), [](const RelativePose* a, const RelativePose* b) {
    return a->matches.size() > b->matches.size();
  });
  Rotations rotation(at(count), Eigen::Quaterniond::Identity());
  std::vector<bool> reached(at(count), false);
  const auto grow = [&] {
    for (const RelativePose* edge : edges) {
      const bool a = reached[at(edge->first)], b = reached[at(edge->second)];
      if (a == b) continue;
      const Eigen::Quaterniond& turn = edge->second_from_first.rotation;
      if (a)
        rotation[at(edge->second)] = turn * rotation[at(edge->first)];
      else
        rotation[at(edge->first)] = turn.conjugate() * rotation[at(edge->second)];
      reached[at(edge->first)] = reached[at(edge->second)] = true;
      return true;
    }
    return false;
  };
  std::vector<int> seeds;
  if (!edges.empty()) seeds.push_back(edges.front()->first);
  for (int f = 0; f < count; ++f) seeds.push_back(f);
  for (const int seed : seeds) {
    reached[at(seed)] = true;
    while (grow()) continue;
  }
  return rotation;
}

/// One weighted step of all rotations towards the pairs and the prior.
void step(const PairCandidates& candidates,
          const std::vector<std::optional<Eigen::Quaterniond>>& prior,
          const RotationOptions& options, double scale, Rotations& rotation) {
  const Eigen::Index size = 3 * static_cast<Eigen::Index>(rotation.size());
  // A little of the identity holds what no pair reaches, and the gauge.
  Eigen::MatrixXd a = 1e-3 * Eigen::MatrixXd::Identity(size, size);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(size);
  const double pair_weight = 1 / std::pow(options.pair_sigma_deg * radians_per_degree, 2),
               prior_weight = 1 / std::pow(options.prior_sigma_deg * radians_per_degree, 2);
  for (const auto& of_pair : candidates) {
    const RelativePose* pair = best_candidate(of_pair, rotation);
    if (pair == nullptr) continue;
    const Eigen::Vector3d r = residual(*pair, rotation);
    const double w = pair_weight / std::pow(1 + r.squaredNorm() / (scale * scale), 2);
    const Eigen::Matrix3d turn = pair->second_from_first.rotation.conjugate().toRotationMatrix();
    const Eigen::Index i = 3 * pair->first, j = 3 * pair->second;
    a.block<3, 3>(i, i) += w * Eigen::Matrix3d::Identity();
    a.block<3, 3>(j, j) += w * Eigen::Matrix3d::Identity();
    a.block<3, 3>(i, j) -= w * turn;
    a.block<3, 3>(j, i) -= w * turn.transpose();
    b.segment<3>(i) += w * r;
    b.segment<3>(j) -= w * turn.transpose() * r;
  }
  for (std::size_t f = 0; f < rotation.size(); ++f) {
    if (!prior[f]) continue;
    const Eigen::Index i = 3 * static_cast<Eigen::Index>(f);
    a.block<3, 3>(i, i) += prior_weight * Eigen::Matrix3d::Identity();
    b.segment<3>(i) -= prior_weight * log_of(rotation[f] * prior[f]->conjugate());
  }
  const Eigen::VectorXd x = a.ldlt().solve(b);
  for (std::size_t f = 0; f < rotation.size(); ++f)
    rotation[f] =
        (turned_by(x.segment<3>(3 * static_cast<Eigen::Index>(f))) * rotation[f]).normalized();
}

}  // namespace

std::vector<std::optional<Eigen::Quaterniond>> nominal_rotations(
    const std::vector<const FrameRecord*>& frames, const std::vector<double>& elevations_deg,
    bool clockwise) {
  std::vector<std::optional<Eigen::Quaterniond>> result;
  for (const FrameRecord* frame : frames) {
    result.emplace_back();
    if (!tells_azimuth(frame->station)) continue;
    const double azimuth = (clockwise ? -1 : 1) * frame->station->azimuth_deg * radians_per_degree;
    const double elevation = elevations_deg[at(frame->station->loop)] * radians_per_degree;
    const Eigen::Vector3d forward(-std::cos(elevation) * std::cos(azimuth),
                                  -std::cos(elevation) * std::sin(azimuth), -std::sin(elevation));
    Eigen::Matrix3d world_from_cam;
    world_from_cam.col(2) = forward;
    world_from_cam.col(0) = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
    world_from_cam.col(1) = forward.cross(world_from_cam.col(0));
    result.back() = Eigen::Quaterniond(Eigen::Matrix3d(world_from_cam.transpose())).normalized();
  }
  return result;
}

std::vector<double> loop_elevations_deg(const std::vector<const FrameRecord*>& frames,
                                        const PairCandidates& candidates) {
  constexpr double usual_deg = 20;
  constexpr double known_sigma_deg = 45;
  int loops = 0;
  for (const FrameRecord* frame : frames)
    if (frame->station) loops = std::max(loops, frame->station->loop + 1);
  std::vector<double> result(at(loops), usual_deg);
  for (int loop = 0; loop < loops; ++loop) {
    std::vector<double> declared, seen;
    for (const FrameRecord* frame : frames)
      if (frame->station && frame->station->loop == loop &&
          frame->station->elevation_sigma_deg.value_or(180) < known_sigma_deg)
        declared.push_back(frame->station->elevation_deg);
    for (const auto& of_pair : candidates)
      for (const RelativePose& pose : of_pair) {
        const auto &a = frames[at(pose.first)]->station, &b = frames[at(pose.second)]->station;
        if (!tells_azimuth(a) || !tells_azimuth(b) || a->loop != loop || b->loop != loop) continue;
        Eigen::Vector3d turn = log_of(pose.second_from_first.rotation);
        const double expected =
            std::abs(std::remainder(a->azimuth_deg - b->azimuth_deg, 360.0)) * radians_per_degree;
        if (std::abs(turn.norm() - expected) > 0.3 * expected ||
            turn.norm() < 5 * radians_per_degree)
          continue;
        turn.normalize();
        if (turn.y() > 0) turn = -turn;  // up is against y in the camera
        if (std::abs(turn.x()) < 0.3)
          seen.push_back(std::atan2(-turn.z(), -turn.y()) / radians_per_degree);
      }
    if (!declared.empty())
      result[at(loop)] = median(declared);
    else if (seen.size() >= 3)
      result[at(loop)] = std::clamp(median(seen), -30.0, 80.0);
  }
  return result;
}

AveragedRotations average_rotations(const PairCandidates& candidates,
                                    const std::vector<std::optional<Eigen::Quaterniond>>& prior,
                                    const RotationOptions& options) {
  const int count = static_cast<int>(prior.size());
  const bool from_prior =
      std::all_of(prior.begin(), prior.end(), [](const auto& p) { return p.has_value(); });
  AveragedRotations result;
  if (from_prior)
    for (const auto& p : prior) result.cam_from_world.push_back(*p);
  else
    result.cam_from_world = along_tree(candidates, count);
  // Along a tree the world is a camera's, in which the prior says nothing.
  const std::vector<std::optional<Eigen::Quaterniond>> used =
      from_prior ? prior : std::vector<std::optional<Eigen::Quaterniond>>(prior.size());
  constexpr int passes = 40;
  for (int pass = 0; pass < passes; ++pass) {
    const double done = static_cast<double>(pass) / (passes - 1);
    const double scale =
        options.first_scale_deg * std::pow(options.last_scale_deg / options.first_scale_deg, done);
    step(candidates, used, options, scale * radians_per_degree, result.cam_from_world);
  }
  result.placed.assign(at(count), false);
  for (const auto& of_pair : candidates) {
    const RelativePose* pair = best_candidate(of_pair, result.cam_from_world);
    if (pair == nullptr) continue;
    const double miss = residual(*pair, result.cam_from_world).norm() / radians_per_degree;
    const double square = std::pow(miss / options.last_scale_deg, 2);
    result.cost += square / (1 + square);
    if (miss > options.max_pair_residual_deg) continue;
    result.kept.emplace_back();
    for (const RelativePose& candidate : of_pair)
      if (residual(candidate, result.cam_from_world).norm() <=
          options.max_pair_residual_deg * radians_per_degree)
        result.kept.back().push_back(candidate);
    result.placed[at(pair->first)] = result.placed[at(pair->second)] = true;
  }
  return result;
}

}  // namespace orbitfuse
