// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/features/gradients.hpp"

#include <immintrin.h>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace orbitfuse {
namespace {

constexpr int polar_lanes = 8;

/// arctan of [0, 1] in turns, by an odd polynomial whose largest error is smallest: 4e-8 turns.
__m256 octant_turns(__m256 ratio) {
  const __m256 square = _mm256_mul_ps(ratio, ratio);
  constexpr std::array<float, 7> coefficients = {0.0010841298f, -0.0053482758f, 0.012672499f,
                                                 -0.021061518f, 0.031525118f,   -0.053026238f,
                                                 0.15915432f};
  __m256 sum = _mm256_set1_ps(coefficients[0]);
  for (std::size_t i = 1; i < coefficients.size(); ++i)
    sum = _mm256_fmadd_ps(sum, square, _mm256_set1_ps(coefficients[i]));
  return _mm256_mul_ps(sum, ratio);
}

/// Length and direction of eight vectors.
void to_polar(const float* by_x, const float* by_y, float* length, float* turns) {
  const __m256 sign = _mm256_set1_ps(-0.0f), x = _mm256_loadu_ps(by_x), y = _mm256_loadu_ps(by_y);
  const __m256 ax = _mm256_andnot_ps(sign, x), ay = _mm256_andnot_ps(sign, y);
  _mm256_storeu_ps(length, _mm256_sqrt_ps(_mm256_fmadd_ps(x, x, _mm256_mul_ps(y, y))));
  const __m256 more = _mm256_max_ps(_mm256_max_ps(ax, ay), _mm256_set1_ps(1e-30f));
  __m256 turn = octant_turns(_mm256_div_ps(_mm256_min_ps(ax, ay), more));
  const auto mirrored_where = [&](__m256 mask, float about) {
    turn = _mm256_blendv_ps(turn, _mm256_sub_ps(_mm256_set1_ps(about), turn), mask);
  };
  mirrored_where(_mm256_cmp_ps(ay, ax, _CMP_GT_OQ), 0.25f);
  mirrored_where(x, 0.5f);  // a blend looks at the sign
  mirrored_where(y, 1.0f);
  const __m256 whole = _mm256_cmp_ps(turn, _mm256_set1_ps(1), _CMP_GE_OQ);
  _mm256_storeu_ps(turns, _mm256_andnot_ps(whole, turn));
}

/// exp(-d^2 / (2 sigma^2)) of the samples from -reach to reach about a place `offset` samples away;
/// behind them zeros for a vector's rest.
std::vector<float> gaussian_weights(int reach, double offset, double sigma) {
  std::vector<float> list;
  for (int i = -reach; i <= reach; ++i) {
    const double d = i - offset;
    list.push_back(static_cast<float>(std::exp(-d * d / (2 * sigma * sigma))));
  }
  list.resize(list.size() + polar_lanes);
  return list;
}

constexpr int descriptor_cells = 4, descriptor_turns = 8;
constexpr double cell_sigmas = 3;  ///< side of a cell in standard deviations of the peak's blur

/// Cells with a frame about them, so that no sample asks whether it is inside, by direction, row
/// and column: what a sample adds to two neighbouring columns is one store.
class CellHistogram {
 public:
  static constexpr int frame = 2;

  /// Eight samples: columns and rows in cells from the centre of the frame's first, directions in
  /// [0, 8), weights; those whose bit is set.
  void add(__m256 columns, __m256 rows, __m256 turns, __m256 weights, unsigned which) {
    const __m256 whole_columns = _mm256_floor_ps(columns), whole_rows = _mm256_floor_ps(rows),
                 whole_turns = _mm256_floor_ps(turns);
    const auto whole = [](__m256 values) { return _mm256_cvttps_epi32(values); };
    const __m256i places = _mm256_add_epi32(
        _mm256_mullo_epi32(whole(whole_turns), _mm256_set1_epi32(plane)),
        _mm256_add_epi32(_mm256_mullo_epi32(whole(whole_rows), _mm256_set1_epi32(side)),
                         whole(whole_columns)));
    const __m256 right = _mm256_sub_ps(columns, whole_columns),
                 below = _mm256_mul_ps(weights, _mm256_sub_ps(rows, whole_rows)),
                 above = _mm256_sub_ps(weights, below), later = _mm256_sub_ps(turns, whole_turns);
    const __m256 above_later = _mm256_mul_ps(above, later),
                 below_later = _mm256_mul_ps(below, later);
    alignas(32) std::array<int, polar_lanes> place;
    alignas(32) std::array<float, polar_lanes> share_right;
    alignas(32) std::array<std::array<float, polar_lanes>, 4> share;
    _mm256_store_si256(reinterpret_cast<__m256i*>(place.data()), places);
    _mm256_store_ps(share_right.data(), right);
    _mm256_store_ps(share[0].data(), _mm256_sub_ps(above, above_later));
    _mm256_store_ps(share[1].data(), _mm256_sub_ps(below, below_later));
    _mm256_store_ps(share[2].data(), above_later);
    _mm256_store_ps(share[3].data(), below_later);
    for (; which != 0; which &= which - 1) {
      const auto lane = static_cast<std::size_t>(__builtin_ctz(which));
      const __m128 pair = _mm_setr_ps(1 - share_right[lane], share_right[lane], 0, 0);
      float* const cell = &sums_[static_cast<std::size_t>(place[lane])];
      for (std::size_t s = 0; s < 4; ++s) {
        auto* const two = reinterpret_cast<__m64*>(cell + corner[s]);
        const __m128 before = _mm_loadl_pi(_mm_setzero_ps(), two);
        _mm_storel_pi(two, _mm_fmadd_ps(_mm_set1_ps(share[s][lane]), pair, before));
      }
    }
  }

  std::array<float, 128> inner() const {
    std::array<float, 128> values;
    auto value = values.begin();
    for (int row = frame; row < frame + descriptor_cells; ++row)
      for (int column = frame; column < frame + descriptor_cells; ++column)
        for (int turn = 0; turn < descriptor_turns; ++turn)
          *value++ = at(turn, row, column) + (turn == 0 ? at(descriptor_turns, row, column) : 0.0f);
    return values;
  }

 private:
  static constexpr int side = descriptor_cells + 4, plane = side * side;
  static constexpr std::array<int, 4> corner = {0, side, plane, plane + side};

  float at(int turn, int row, int column) const {
    return sums_[static_cast<std::size_t>(turn * plane + row * side + column)];
  }

  std::array<float, (descriptor_turns + 1) * plane> sums_{};
};

void scale_to_unit(std::array<float, 128>& values) {
  double squares = 0;
  for (const float value : values) squares += static_cast<double>(value) * value;
  if (squares == 0) return;
  const auto gain = static_cast<float>(1 / std::sqrt(squares));
  for (float& value : values) value *= gain;
}

}  // namespace

Gradients gradients(const cv::Mat& level) {
  const int width = level.cols, height = level.rows;
  const int padded = (width + 2 * polar_lanes - 1) / polar_lanes *
                     polar_lanes;  // a vector may begin at the last sample
  Gradients result{cv::Mat(height, padded, CV_32F, cv::Scalar(0)),
                   cv::Mat(height, padded, CV_32F, cv::Scalar(0))};
  std::vector<float> by_x(static_cast<std::size_t>(padded)), by_y(by_x);
  for (int y = 0; y < height; ++y) {
    const int above = std::max(y - 1, 0), below = std::min(y + 1, height - 1);
    const float *row = level.ptr<float>(y), *up = level.ptr<float>(above),
                *down = level.ptr<float>(below);
    const float per_row = below - above == 2 ? 0.5f : 1.0f;
    for (int x = 1; x + 1 < width; ++x)
      by_x[static_cast<std::size_t>(x)] = 0.5f * (row[x + 1] - row[x - 1]);
    by_x[0] = row[std::min(1, width - 1)] - row[0];
    by_x[static_cast<std::size_t>(width - 1)] = row[width - 1] - row[std::max(width - 2, 0)];
    for (int x = 0; x < width; ++x) by_y[static_cast<std::size_t>(x)] = per_row * (down[x] - up[x]);
    for (int x = 0; x < width; x += polar_lanes)
      to_polar(&by_x[static_cast<std::size_t>(x)], &by_y[static_cast<std::size_t>(x)],
               result.length.ptr<float>(y) + x, result.turns.ptr<float>(y) + x);
  }
  result.length = result.length.colRange(0, width);
  result.turns = result.turns.colRange(0, width);
  return result;
}

std::vector<float> dominant_turns(const Gradients& gradients, const ScaleExtremum& at) {
  constexpr int bins = 36, smoothings = 6;
  constexpr double window = 1.5;  // of the peak's own blur (Lowe, 5)
  const double sigma = window * at.sigma;
  const int reach = std::max(static_cast<int>(3 * sigma), 1);
  const int width = gradients.length.cols, height = gradients.length.rows;
  const int cx = static_cast<int>(at.x + 0.5), cy = static_cast<int>(at.y + 0.5);
  const std::vector<float> by_x = gaussian_weights(reach, at.x - cx, sigma),
                           by_y = gaussian_weights(reach, at.y - cy, sigma);
  // A bin before the first and one behind the last, which are the last and the first.
  std::array<float, bins + 2> open{};
  for (int y = std::max(cy - reach, 0); y <= std::min(cy + reach, height - 1); ++y) {
    // A circle of samples.
    const double dy = y - at.y, half = reach * reach + 0.6 - dy * dy;
    if (half <= 0) continue;
    const double half_width = std::sqrt(half);
    const int left = std::max({cx - reach, 0, static_cast<int>(std::floor(at.x - half_width)) + 1});
    const int right =
        std::min({cx + reach, width - 1, static_cast<int>(std::ceil(at.x + half_width)) - 1});
    const float *length = gradients.length.ptr<float>(y), *turns = gradients.turns.ptr<float>(y);
    const float row_weight = by_y[static_cast<std::size_t>(y - cy + reach)];
    for (int x = left; x <= right; ++x) {
      const float weight = row_weight * by_x[static_cast<std::size_t>(x - cx + reach)] * length[x];
      const float bin = bins * turns[x] + 0.5f;
      const auto whole = static_cast<std::size_t>(static_cast<int>(bin));
      const float later = weight * (bin - static_cast<float>(whole));
      open[whole] += weight - later;
      open[whole + 1] += later;
    }
  }
  std::array<double, bins> sums;
  std::copy_n(open.begin() + 1, bins, sums.begin());
  sums.back() += open.front();
  sums.front() += open.back();
  for (int i = 0; i < smoothings; ++i) {
    const std::array<double, bins> before = sums;
    for (std::size_t b = 0; b < bins; ++b)
      sums[b] = (before[(b + bins - 1) % bins] + before[b] + before[(b + 1) % bins]) / 3;
  }
  const double least = 0.8 * *std::max_element(sums.begin(), sums.end());
  std::vector<float> found;
  for (std::size_t b = 0; b < bins && found.size() < 4; ++b) {
    const double value = sums[b], left = sums[(b + bins - 1) % bins], right = sums[(b + 1) % bins];
    if (value <= least || value <= left || value <= right) continue;
    const double offset = -0.5 * (right - left) / (right + left - 2 * value);
    found.push_back(static_cast<float>((static_cast<double>(b) + offset + 0.5) / bins));
  }
  return found;
}

std::array<float, 128> descriptor(const Gradients& gradients, const ScaleExtremum& at,
                                  float turns) {
  const double cell = cell_sigmas * at.sigma;
  const double angle = 2 * std::numbers::pi * turns;
  const auto cosine = static_cast<float>(std::cos(angle) / cell),
             sine = static_cast<float>(std::sin(angle) / cell);
  const int reach = static_cast<int>(std::numbers::sqrt2 * cell * (descriptor_cells + 1) / 2 + 0.5);
  const int cx = static_cast<int>(at.x + 0.5), cy = static_cast<int>(at.y + 0.5);
  // Gaussian of half the descriptor's side, Lowe's window.
  const std::vector<float> by_x = gaussian_weights(reach, at.x - cx, cell * descriptor_cells / 2),
                           by_y = gaussian_weights(reach, at.y - cy, cell * descriptor_cells / 2);
  // From the peak to the centre of the frame's first cell.
  const __m256 to_first = _mm256_set1_ps(CellHistogram::frame + 0.5f * (descriptor_cells - 1));
  const __m256 rim = _mm256_set1_ps(0.5f * (descriptor_cells + 1)), sign = _mm256_set1_ps(-0.0f);
  const __m256 along = _mm256_set1_ps(cosine), across = _mm256_set1_ps(sine);
  const __m256 lane = _mm256_setr_ps(0, 1, 2, 3, 4, 5, 6, 7);
  CellHistogram histogram;
  const int left = std::max(cx - reach, 1), right = std::min(cx + reach, gradients.length.cols - 2);
  const int top = std::max(cy - reach, 1), bottom = std::min(cy + reach, gradients.length.rows - 2);
  for (int y = top; y <= bottom; ++y) {
    const float *length = gradients.length.ptr<float>(y), *turn = gradients.turns.ptr<float>(y);
    const __m256 row_weight = _mm256_set1_ps(by_y[static_cast<std::size_t>(y - cy + reach)]);
    const __m256 dy = _mm256_set1_ps(static_cast<float>(y - at.y));
    for (int x = left; x <= right; x += polar_lanes) {
      const __m256 dx = _mm256_add_ps(_mm256_set1_ps(static_cast<float>(x - at.x)), lane);
      const __m256 column = _mm256_fmadd_ps(along, dx, _mm256_mul_ps(across, dy)),
                   row = _mm256_fmsub_ps(along, dy, _mm256_mul_ps(across, dx));
      const __m256 farther =
          _mm256_max_ps(_mm256_andnot_ps(sign, column), _mm256_andnot_ps(sign, row));
      unsigned inside =
          static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(farther, rim, _CMP_LT_OQ)));
      if (right - x + 1 < polar_lanes) inside &= (1u << (right - x + 1)) - 1;
      if (inside == 0) continue;
      const __m256 weight = _mm256_mul_ps(
          _mm256_mul_ps(row_weight,
                        _mm256_loadu_ps(&by_x[static_cast<std::size_t>(x - cx + reach)])),
          _mm256_loadu_ps(length + x));
      __m256 relative = _mm256_sub_ps(_mm256_loadu_ps(turn + x), _mm256_set1_ps(turns));
      relative = _mm256_sub_ps(relative, _mm256_floor_ps(relative));
      // Just below a whole turn rounds to one, which has a ninth direction to go to, but no tenth.
      const __m256 direction = _mm256_min_ps(
          _mm256_mul_ps(relative, _mm256_set1_ps(descriptor_turns)), _mm256_set1_ps(7.999999f));
      histogram.add(_mm256_add_ps(column, to_first), _mm256_add_ps(row, to_first), direction,
                    weight, inside);
    }
  }
  std::array<float, 128> values = histogram.inner();
  scale_to_unit(values);
  for (float& value : values) value = std::min(value, 0.2f);
  scale_to_unit(values);
  return values;
}

}  // namespace orbitfuse
