// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/clouds/outlier_filter.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/geometry/kd_tree.hpp"
#include "core/numeric/median.hpp"

namespace orbitfuse::registration {
namespace {

constexpr std::size_t neighbour_count = 31;  // the point itself and thirty
constexpr std::size_t spanning = 13;         // planes go through two of the nearest of these
constexpr double slab_share = 0.03;          // half thickness in which points support a plane

using Neighbourhood = std::array<std::size_t, neighbour_count>;

/// 0 flat .. 1 round: root of smallest over largest variance.
double thickness(const Points& points, const Neighbourhood& around, std::size_t count) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t j = 0; j < count; ++j) mean += points[around[j]] / static_cast<double>(count);
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (std::size_t j = 0; j < count; ++j) {
    scatter += (points[around[j]] - mean) * (points[around[j]] - mean).transpose();
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(scatter, Eigen::EigenvaluesOnly);
  const Eigen::Vector3d& e = solver.eigenvalues();
  return e[2] > 0 ? std::sqrt(std::max(0.0, e[0] / e[2])) : 0;
}

/// Most points near one plane through the first point, over planes through pairs of its neighbours.
double best_plane_support(const Points& points, const Neighbourhood& around) {
  // A column a point, the first the point itself at zero; padded to whole registers.
  constexpr std::size_t histogram_columns = 32;
  std::array<float, histogram_columns> x{}, y{}, z{};
  std::array<Eigen::Vector3f, neighbour_count> d;
  for (std::size_t j = 0; j < neighbour_count; ++j) {
    d[j] = ((points[around[j]] - points[around[0]]) / slab_share).cast<float>();
    x[j] = d[j].x();
    y[j] = d[j].y();
    z[j] = d[j].z();
  }
  constexpr float always = histogram_columns - neighbour_count + 1;  // zeros lie on every plane
  float best = always;
  for (std::size_t a = 1; a <= spanning; ++a) {
    for (std::size_t b = a + 1; b <= spanning; ++b) {
      const Eigen::Vector3f normal = d[a].cross(d[b]);
      const float length2 = normal.squaredNorm();
      if (length2 < 0.09f * d[a].squaredNorm() * d[b].squaredNorm()) continue;
      const float per_length2 = 1 / std::max(length2, 1e-12f);
      std::array<float, 8> support{};
      for (std::size_t j = 0; j < histogram_columns; j += 8) {
        for (std::size_t k = 0; k < 8; ++k) {
          const float h = normal.x() * x[j + k] + normal.y() * y[j + k] + normal.z() * z[j + k];
          support[k] += std::max(0.0f, 1 - h * h * per_length2);
        }
      }
      best = std::max(best, std::accumulate(support.begin(), support.end(), 0.0f));
    }
  }
  return best - always;
}

/// Low for points on a surface: minus the log of the plane's support per area.
struct Scatter {
  std::vector<double> strangeness, thickness;
};

Scatter scatter_of(const Points& points) {
  const KdTree tree(points);
  Scatter scatter;
  for (const auto& p : points) {
    Neighbourhood around;
    std::array<double, neighbour_count> d2;
    tree.nearest(p, neighbour_count, around.data(), d2.data());
    const double area = std::max(d2.back(), 1e-12);
    scatter.strangeness.push_back(-std::log((best_plane_support(points, around) + 0.1) / area));
    scatter.thickness.push_back(thickness(points, around, 16));
  }
  return scatter;
}

struct Split {
  double limit = INFINITY;
  double separation = 0;  ///< of the means in pooled standard deviations
  double step = 0;        ///< between the means
};

/// Two populations with the least variance inside (Otsu 1979) over exact order statistics.
Split otsu(std::vector<double> sorted) {
  std::sort(sorted.begin(), sorted.end());
  const std::size_t n = sorted.size();
  std::vector<double> sum(n + 1, 0), squares(n + 1, 0);
  for (std::size_t i = 0; i < n; ++i) {
    sum[i + 1] = sum[i] + sorted[i];
    squares[i + 1] = squares[i] + sorted[i] * sorted[i];
  }
  const auto mean_variance = [&](std::size_t a, std::size_t b) {
    const double count = static_cast<double>(b - a), mean = (sum[b] - sum[a]) / count;
    return std::pair(mean, std::max(0.0, (squares[b] - squares[a]) / count - mean * mean));
  };
  double least = INFINITY;
  std::size_t at = n / 2;
  for (std::size_t i = n / 10; i < n - n / 50; ++i) {
    const double within = static_cast<double>(i) * mean_variance(0, i).second +
                          static_cast<double>(n - i) * mean_variance(i, n).second;
    if (within < least) {
      least = within;
      at = i;
    }
  }
  const auto [near_mean, near_variance] = mean_variance(0, at);
  const auto [far_mean, far_variance] = mean_variance(at, n);
  Split split;
  split.limit = sorted[at];
  split.step = far_mean - near_mean;
  split.separation = split.step / std::sqrt(near_variance + far_variance + 1e-6);
  return split;
}

}  // namespace

Points without_outliers(const Points& points) {
  // A sparse part of a surface is flat and 1 % noise 0.4 thick; points that fill space are 0.55.
  constexpr double thick_share = 0.42, volume_share = 0.46;
  Points kept = points;
  for (int pass = 0; pass < 4 && kept.size() >= 200; ++pass) {
    const Scatter scatter = scatter_of(kept);
    const Split split = otsu(scatter.strangeness);
    std::vector<double> far_thickness;
    Points near;
    for (std::size_t i = 0; i < kept.size(); ++i) {
      if (scatter.strangeness[i] < split.limit) {
        near.push_back(kept[i]);
      } else {
        far_thickness.push_back(scatter.thickness[i]);
      }
    }
    const double thick = median(far_thickness);
    const bool two_populations = split.separation > 2.0 && split.step > 0.7 && thick > thick_share;
    const bool drowned =
        split.separation > 1.5 && split.step > (pass == 0 ? 0.5 : 0.65) && thick > volume_share;
    if (!(two_populations || drowned) ||
        near.size() < std::max<std::size_t>(20, points.size() / 12))
      break;
    kept = std::move(near);
  }
  return kept;
}

}  // namespace orbitfuse::registration
