// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/descriptor_matching.hpp"

#include <immintrin.h>
#include <algorithm>
#include <array>
#include <cmath>

namespace orbitfuse {
namespace {

constexpr Eigen::Index products_at_once = 8;

double angle_rad(float product) {
  return std::acos(std::clamp(product / (512.0 * 512.0), 0.0, 1.0));
}

/// The nearest and the runner-up of each feature of an image, by inner product; of equal ones the
/// first that was offered.
struct Nearest {
  std::vector<float> best, second;  ///< with room for a whole vector behind the last
  std::vector<int> index;

  explicit Nearest(Eigen::Index features)
      : best(static_cast<std::size_t>(features + products_at_once), -1.0F),
        second(best),
        index(best.size(), -1) {}

  void offer(Eigen::Index feature, float product, Eigen::Index candidate) {
    const auto f = static_cast<std::size_t>(feature);
    if (product > best[f]) {
      second[f] = best[f];
      best[f] = product, index[f] = static_cast<int>(candidate);
    } else if (product > second[f]) {
      second[f] = product;
    }
  }

  bool passes(std::size_t feature, const DescriptorMatchOptions& options) const {
    if (index[feature] < 0) return false;
    const double nearest = angle_rad(best[feature]);
    return nearest <= options.max_distance_rad &&
           (second[feature] < 0 || nearest < options.max_ratio * angle_rad(second[feature]));
  }
};

/// Nearest and runner-up, a lane each, as Nearest keeps them.
struct Best {
  __m256 best, second;
  __m256i index;

  void offer(__m256 product, __m256i candidate) {
    const __m256 nearer = _mm256_cmp_ps(product, best, _CMP_GT_OQ);
    second = _mm256_max_ps(second, _mm256_min_ps(best, product));
    best = _mm256_max_ps(best, product);
    index = _mm256_blendv_epi8(index, candidate, _mm256_castps_si256(nearer));
  }
};

struct Offers {
  Nearest of_first, of_second;

  Offers(const Descriptors& first, const Descriptors& second)
      : of_first(first.rows()), of_second(second.rows()) {}

  void add(Eigen::Index a, Eigen::Index b, float product) {
    of_first.offer(a, product, b);
    of_second.offer(b, product, a);
  }

  /// A feature of the first image with all of the second's. Behind the last product there is room
  /// for a whole vector.
  void add_row(Eigen::Index a, const float* products, Eigen::Index count) {
    const __m256i row = _mm256_set1_epi32(static_cast<int>(a));
    Best of_row{_mm256_set1_ps(-1), _mm256_set1_ps(-1), _mm256_set1_epi32(-1)};
    __m256i column = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    for (Eigen::Index c = 0; c < count; c += products_at_once) {
      __m256 product = _mm256_loadu_ps(products + c);
      if (count - c < products_at_once)  // what lies behind the last is no offer
        product = _mm256_blendv_ps(_mm256_set1_ps(-1), product,
                                   _mm256_castsi256_ps(_mm256_cmpgt_epi32(
                                       _mm256_set1_epi32(static_cast<int>(count)), column)));
      of_row.offer(product, column);
      const auto at = static_cast<std::size_t>(c);
      auto* const index = reinterpret_cast<__m256i*>(&of_second.index[at]);
      Best of_column{_mm256_loadu_ps(&of_second.best[at]), _mm256_loadu_ps(&of_second.second[at]),
                     _mm256_loadu_si256(index)};
      of_column.offer(product, row);
      _mm256_storeu_ps(&of_second.best[at], of_column.best);
      _mm256_storeu_ps(&of_second.second[at], of_column.second);
      _mm256_storeu_si256(index, of_column.index);
      column = _mm256_add_epi32(column, _mm256_set1_epi32(products_at_once));
    }
    merge(of_row, a);
  }

  std::vector<FeatureMatch> mutual(Eigen::Index count,
                                   const DescriptorMatchOptions& options) const {
    std::vector<FeatureMatch> matches;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      if (!of_first.passes(i, options)) continue;
      const auto there = static_cast<std::size_t>(of_first.index[i]);
      if (of_second.index[there] == static_cast<int>(i) && of_second.passes(there, options))
        matches.emplace_back(static_cast<int>(i), of_first.index[i]);
    }
    return matches;
  }

 private:
  /// The lanes' answers: of equal ones the lower index.
  void merge(const Best& of_row, Eigen::Index a) {
    std::array<float, products_at_once> best, second;
    std::array<int, products_at_once> index;
    _mm256_storeu_ps(best.data(), of_row.best);
    _mm256_storeu_ps(second.data(), of_row.second);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(index.data()), of_row.index);
    std::size_t nearest = 0;
    for (std::size_t l = 1; l < best.size(); ++l)
      if (best[l] > best[nearest] || (best[l] == best[nearest] && index[l] < index[nearest]))
        nearest = l;
    float runner_up = second[nearest];
    for (std::size_t l = 0; l < best.size(); ++l)
      if (l != nearest) runner_up = std::max(runner_up, best[l]);
    const auto f = static_cast<std::size_t>(a);
    of_first.best[f] = best[nearest], of_first.second[f] = runner_up;
    of_first.index[f] = index[nearest];
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
  const Eigen::Index stride = second.rows() + products_at_once;
  Descriptors products(block, stride);
  for (Eigen::Index begin = 0; begin < first.rows(); begin += block) {
    const Eigen::Index rows = std::min(block, first.rows() - begin);
    products.topLeftCorner(rows, second.rows()).noalias() =
        first.middleRows(begin, rows) * second.transpose();
    for (Eigen::Index r = 0; r < rows; ++r)
      offers.add_row(begin + r, products.data() + r * stride, second.rows());
  }
  return offers.mutual(first.rows(), options);
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
  return offers.mutual(first.rows(), options);
}

}  // namespace orbitfuse
