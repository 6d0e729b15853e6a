// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/descriptor_matching.hpp"

#include <algorithm>
#include <cmath>

namespace orbitfuse {
namespace {

/// The nearest and the runner-up of one feature, by inner product.
struct Nearest {
  float best = -1, second = -1;
  int index = -1;

  void offer(float product, int candidate) {
    if (product > best) {
      second = best;
      best = product, index = candidate;
    } else if (product > second) {
      second = product;
    }
  }
};

double angle_rad(float product) {
  return std::acos(std::clamp(product / (512.0 * 512.0), 0.0, 1.0));
}

bool passes(const Nearest& nearest, const DescriptorMatchOptions& options) {
  if (nearest.index < 0) return false;
  const double best = angle_rad(nearest.best);
  return best <= options.max_distance_rad &&
         (nearest.second < 0 || best < options.max_ratio * angle_rad(nearest.second));
}

struct Offers {
  std::vector<Nearest> of_first, of_second;

  Offers(const Descriptors& first, const Descriptors& second)
      : of_first(static_cast<std::size_t>(first.rows())),
        of_second(static_cast<std::size_t>(second.rows())) {}

  void add(Eigen::Index a, Eigen::Index b, float product) {
    of_first[static_cast<std::size_t>(a)].offer(product, static_cast<int>(b));
    of_second[static_cast<std::size_t>(b)].offer(product, static_cast<int>(a));
  }

  std::vector<FeatureMatch> mutual(const DescriptorMatchOptions& options) const {
    std::vector<FeatureMatch> matches;
    for (std::size_t i = 0; i < of_first.size(); ++i) {
      if (!passes(of_first[i], options)) continue;
      const Nearest& back = of_second[static_cast<std::size_t>(of_first[i].index)];
      if (back.index == static_cast<int>(i) && passes(back, options))
        matches.emplace_back(static_cast<int>(i), of_first[i].index);
    }
    return matches;
  }
};

}  // namespace

Eigen::Vector3d EpipolarBand::line_of(Eigen::Index first) const {
  const Eigen::Vector3d line = essential * first_rays.col(first);
  return line / std::max(line.head<2>().norm(), 1e-12);
}

double EpipolarBand::distance(Eigen::Index first, Eigen::Index second) const {
  return std::abs(line_of(first).dot(second_rays.col(second)));
}

std::vector<FeatureMatch> match_descriptors(const Descriptors& first, const Descriptors& second,
                                            const DescriptorMatchOptions& options) {
  if (first.rows() == 0 || second.rows() == 0) return {};  // a blank view has none
  Offers offers(first, second);
  constexpr Eigen::Index block = 64;  // products of a block stay in the cache while they are read
  Descriptors products;
  for (Eigen::Index begin = 0; begin < first.rows(); begin += block) {
    const Eigen::Index rows = std::min(block, first.rows() - begin);
    products.noalias() = first.middleRows(begin, rows) * second.transpose();
    for (Eigen::Index r = 0; r < rows; ++r)
      for (Eigen::Index c = 0; c < second.rows(); ++c) offers.add(begin + r, c, products(r, c));
  }
  return offers.mutual(options);
}

std::vector<FeatureMatch> match_in_band(const Descriptors& first, const Descriptors& second,
                                        const EpipolarBand& band,
                                        const DescriptorMatchOptions& options) {
  if (first.rows() == 0 || second.rows() == 0) return {};
  Offers offers(first, second);
  // A band admits about a hundredth of the pairs: only those are multiplied.
  const Eigen::Matrix<double, Eigen::Dynamic, 3> rays = band.second_rays.transpose();
  Eigen::VectorXd off(rays.rows());
  for (Eigen::Index a = 0; a < first.rows(); ++a) {
    off.noalias() = rays * band.line_of(a);
    for (Eigen::Index b = 0; b < off.size(); ++b)
      if (std::abs(off(b)) <= band.half_width) offers.add(a, b, first.row(a).dot(second.row(b)));
  }
  return offers.mutual(options);
}

}  // namespace orbitfuse
