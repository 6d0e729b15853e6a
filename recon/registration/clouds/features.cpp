// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/clouds/features.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "recon/registration/clouds/thinning.hpp"

namespace orbitfuse::registration {
namespace {

constexpr int histogram_bins = 11;

/// atan2 / pi, to 0.002: far below a bin's width.
float angle_over_pi(float y, float x) {
  const float ax = std::abs(x), ay = std::abs(y), high = std::max(ax, ay);
  if (high == 0) return 0;
  const float r = std::min(ax, ay) / high;
  float angle = r * (0.25f + 0.0868f * (1.0f - r));
  if (ay > ax) angle = 0.5f - angle;
  if (x < 0) angle = 1.0f - angle;
  return y < 0 ? -angle : angle;
}

/// A vote at `value` in -1..1, shared between the two nearest bins.
void vote(float* bins, float value, bool wraps, float weight) {
  const float at = (value + 1) * (0.5f * histogram_bins) - 0.5f;
  const int low = static_cast<int>(std::floor(at));
  const float share = at - static_cast<float>(low);
  const auto slot = [&](int bin) {
    return wraps ? (bin + histogram_bins) % histogram_bins : std::clamp(bin, 0, histogram_bins - 1);
  };
  bins[slot(low)] += weight * (1 - share);
  bins[slot(low + 1)] += weight * share;
}

struct Neighbour {
  int index;
  float distance;
};

/// All pairs by brute force: a thousand points need a million distances, a millisecond.
std::vector<std::vector<Neighbour>> neighbours_within(const Points& points, double radius) {
  const auto n = static_cast<int>(points.size());
  Eigen::Matrix<float, 3, Eigen::Dynamic> p(3, n);
  for (int i = 0; i < n; ++i) p.col(i) = points[static_cast<std::size_t>(i)].cast<float>();
  std::vector<std::vector<Neighbour>> lists(points.size());
  const auto limit = static_cast<float>(radius * radius);
  Eigen::Array<float, 1, Eigen::Dynamic> d2(n);
  for (int i = 0; i < n; ++i) {
    d2 = (p.colwise() - p.col(i)).colwise().squaredNorm().array();
    for (int j = 0; j < n; ++j) {
      if (d2[j] < limit && j != i && d2[j] > 1e-12f) {
        lists[static_cast<std::size_t>(i)].push_back({j, std::sqrt(d2[j])});
      }
    }
  }
  return lists;
}

/// The Darboux-frame angles of a pair (Rusu et al. 2009, eq. 1), as three 11-bin votes.
void vote_pair(float* bins, const Eigen::Vector3f& between, float distance,
               const Eigen::Vector3f& normal, const Eigen::Vector3f& other_normal) {
  const Eigen::Vector3f direction = between / distance;
  const Eigen::Vector3f v = direction.cross(normal);
  const float length = v.norm();
  if (length < 1e-6f) return;
  const Eigen::Vector3f v_unit = v / length;
  const Eigen::Vector3f w = normal.cross(v_unit);
  vote(bins, v_unit.dot(other_normal), false, 1);
  vote(bins + histogram_bins, normal.dot(direction), false, 1);
  vote(bins + 2 * histogram_bins, angle_over_pi(w.dot(other_normal), normal.dot(other_normal)),
       true, 1);
}

void normalise_parts(float* bins) {
  for (int part = 0; part < 3; ++part) {
    Eigen::Map<Eigen::Array<float, histogram_bins, 1>> h(bins + part * histogram_bins);
    const float sum = h.sum();
    if (sum > 0) h /= sum;
  }
}

}  // namespace

FeaturePoints feature_points(const PreparedCloud& cloud, int wanted) {
  FeaturePoints features;
  const Points coarse = thinned_to(cloud.points, wanted);
  for (const auto& p : coarse) {
    const std::optional<std::size_t> nearest = cloud.nearest(p);
    if (!nearest) continue;
    features.points.push_back(cloud.points[*nearest]);
    features.normals.push_back(cloud.normals[*nearest]);
  }
  return features;
}

Descriptors describe(const FeaturePoints& cloud, double radius) {
  const auto n = static_cast<int>(cloud.points.size());
  const auto lists = neighbours_within(cloud.points, radius);
  Descriptors simple = Descriptors::Zero(33, n);
  for (int i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Eigen::Vector3f normal = cloud.normals[at].cast<float>();
    for (const Neighbour& neighbour : lists[at]) {
      const auto to = static_cast<std::size_t>(neighbour.index);
      vote_pair(simple.col(i).data(), (cloud.points[to] - cloud.points[at]).cast<float>(),
                neighbour.distance, normal, cloud.normals[to].cast<float>());
    }
    normalise_parts(simple.col(i).data());
  }
  Descriptors fast = simple;
  const auto floor_distance = static_cast<float>(0.2 * radius);
  for (int i = 0; i < n; ++i) {
    const auto& list = lists[static_cast<std::size_t>(i)];
    Eigen::Matrix<float, 33, 1> sum = Eigen::Matrix<float, 33, 1>::Zero();
    float weights = 0;
    for (const Neighbour& neighbour : list) {
      const float w = 1.0f / std::max(neighbour.distance, floor_distance);
      sum += w * simple.col(neighbour.index);
      weights += w;
    }
    if (weights > 0) fast.col(i) += sum / weights;
    // Hellinger: root bins make the Euclidean distance a fair one between histograms.
    fast.col(i) = fast.col(i).cwiseSqrt();
    const float norm = fast.col(i).norm();
    if (norm > 0) fast.col(i) /= norm;
  }
  return fast;
}

std::vector<Match> mutual_matches(const Descriptors& source, const Descriptors& target, int most) {
  const Eigen::MatrixXf similarity = target.transpose() * source;  // column: one source point
  std::vector<std::optional<Eigen::Index>> best_source(static_cast<std::size_t>(target.cols()));
  Eigen::VectorXf best_value = Eigen::VectorXf::Constant(target.cols(), -1);
  for (Eigen::Index s = 0; s < similarity.cols(); ++s) {
    for (Eigen::Index t = 0; t < similarity.rows(); ++t) {
      if (similarity(t, s) > best_value[t]) {
        best_value[t] = similarity(t, s);
        best_source[static_cast<std::size_t>(t)] = s;
      }
    }
  }
  std::vector<Match> matches;
  for (Eigen::Index s = 0; s < similarity.cols(); ++s) {
    Eigen::Index t = 0;
    const float value = similarity.col(s).maxCoeff(&t);
    if (value <= 0 || best_source[static_cast<std::size_t>(t)] != s) continue;
    matches.push_back(
        {static_cast<int>(s), static_cast<int>(t), std::sqrt(std::max(0.0f, 2 - 2 * value))});
  }
  std::stable_sort(matches.begin(), matches.end(),
                   [](const Match& a, const Match& b) { return a.distance < b.distance; });
  if (static_cast<int>(matches.size()) > most) matches.resize(static_cast<std::size_t>(most));
  return matches;
}

}  // namespace orbitfuse::registration
