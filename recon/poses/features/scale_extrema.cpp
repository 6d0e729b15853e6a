// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/features/scale_extrema.hpp"

#include <immintrin.h>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <optional>

namespace orbitfuse {
namespace {

/// Differences of neighbouring levels about one scale, never stored: few samples are asked for more
/// than their nearest.
class Differences {
 public:
  Differences(const Octave& octave, int scale) {
    for (int s = 0; s < 4; ++s) levels_[static_cast<std::size_t>(s)] = octave.level(scale - 1 + s);
  }

  int width() const { return levels_[0].cols; }
  int height() const { return levels_[0].rows; }

  /// ds: -1, 0 or 1.
  float at(int x, int y, int ds) const {
    return upper(ds).at<float>(y, x) - lower(ds).at<float>(y, x);
  }

  /// Of the eight samples from x on, those beyond `least` and beyond the four nearest of their own
  /// scale: a bit each.
  unsigned candidates(int x, int y, float least) const {
    const auto eight = [&](int dx, int dy) {
      return _mm256_sub_ps(_mm256_loadu_ps(upper(0).ptr<float>(y + dy) + x + dx),
                           _mm256_loadu_ps(lower(0).ptr<float>(y + dy) + x + dx));
    };
    const __m256 value = eight(0, 0), limit = _mm256_set1_ps(least);
    __m256 peak = _mm256_cmp_ps(value, limit, _CMP_GE_OQ);
    __m256 pit = _mm256_cmp_ps(value, _mm256_sub_ps(_mm256_setzero_ps(), limit), _CMP_LE_OQ);
    if (_mm256_movemask_ps(_mm256_or_ps(peak, pit)) == 0) return 0;
    for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
      const __m256 other = eight(dx, dy);
      peak = _mm256_and_ps(peak, _mm256_cmp_ps(value, other, _CMP_GT_OQ));
      pit = _mm256_and_ps(pit, _mm256_cmp_ps(value, other, _CMP_LT_OQ));
    }
    return static_cast<unsigned>(_mm256_movemask_ps(_mm256_or_ps(peak, pit)));
  }

  bool is_extremum(int x, int y) const {
    const float value = at(x, y, 0), sign = value > 0 ? 1.0f : -1.0f;
    for (const int ds : {0, -1, 1})
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
          if ((ds != 0 || dx != 0 || dy != 0) && sign * at(x + dx, y + dy, ds) >= sign * value)
            return false;
    return true;
  }

 private:
  const cv::Mat& lower(int ds) const { return levels_[static_cast<std::size_t>(ds + 1)]; }
  const cv::Mat& upper(int ds) const { return levels_[static_cast<std::size_t>(ds + 2)]; }

  std::array<cv::Mat, 4> levels_;
};

struct Derivatives {
  double value;
  Eigen::Vector3d gradient;  ///< by x, y, scale
  Eigen::Matrix3d hessian;

  Derivatives(const Differences& differences, int x, int y) {
    const auto at = [&](int dx, int dy, int ds) {
      return static_cast<double>(differences.at(x + dx, y + dy, ds));
    };
    value = at(0, 0, 0);
    gradient = {0.5 * (at(1, 0, 0) - at(-1, 0, 0)), 0.5 * (at(0, 1, 0) - at(0, -1, 0)),
                0.5 * (at(0, 0, 1) - at(0, 0, -1))};
    const double xx = at(1, 0, 0) + at(-1, 0, 0) - 2 * value,
                 yy = at(0, 1, 0) + at(0, -1, 0) - 2 * value,
                 ss = at(0, 0, 1) + at(0, 0, -1) - 2 * value,
                 xy = 0.25 * (at(1, 1, 0) + at(-1, -1, 0) - at(-1, 1, 0) - at(1, -1, 0)),
                 xs = 0.25 * (at(1, 0, 1) + at(-1, 0, -1) - at(-1, 0, 1) - at(1, 0, -1)),
                 ys = 0.25 * (at(0, 1, 1) + at(0, -1, -1) - at(0, -1, 1) - at(0, 1, -1));
    hessian << xx, xy, xs, xy, yy, ys, xs, ys, ss;
  }

  /// To the peak of the parabola; none where it has no single one.
  Eigen::Vector3d offset() const {
    const Eigen::FullPivLU<Eigen::Matrix3d> curvature(hessian);
    if (!curvature.isInvertible()) return Eigen::Vector3d::Zero();
    return curvature.solve(-gradient);
  }

  /// Squared trace over determinant of the curvatures in the image: large along edges (Lowe, 4.1).
  double edge_score() const {
    const double trace = hessian(0, 0) + hessian(1, 1);
    return trace * trace / hessian.topLeftCorner<2, 2>().determinant();
  }
};

/// From a sample to the peak near it: by whole samples towards where the parabola has it, then
/// between them.
std::optional<ScaleExtremum> refined(const Differences& differences, int x, int y, int scale,
                                     double peak_threshold, double edge_threshold) {
  constexpr int most_steps = 4;
  constexpr double step_from = 0.6;  // nearer to the next sample than to this one, with some slack
  constexpr double farthest = 1.5;   // beyond, the parabola says nothing
  const int width = differences.width(), height = differences.height();
  const auto step = [&](double by, int at, int size) {
    return by > step_from && at < size - 2 ? 1 : by < -step_from && at > 1 ? -1 : 0;
  };
  Derivatives here(differences, x, y);
  Eigen::Vector3d offset = here.offset();
  for (int steps = 0; steps < most_steps; ++steps) {
    const int dx = step(offset.x(), x, width), dy = step(offset.y(), y, height);
    if (dx == 0 && dy == 0) break;
    x += dx, y += dy;
    here = Derivatives(differences, x, y);
    offset = here.offset();
  }
  const double contrast = here.value + 0.5 * here.gradient.dot(offset), edge = here.edge_score();
  const double edge_limit = (edge_threshold + 1) * (edge_threshold + 1) / edge_threshold;
  const double px = x + offset.x(), py = y + offset.y(), ps = scale + offset.z();
  const bool good = std::abs(contrast) > peak_threshold && edge >= 0 && edge < edge_limit &&
                    offset.cwiseAbs().maxCoeff() < farthest && px >= 0 && px <= width - 1 &&
                    py >= 0 && py <= height - 1 && ps >= -1 && ps <= scales_per_octave + 1;
  if (!good) return {};
  return ScaleExtremum{px, py, Octave::sigma(ps)};
}

}  // namespace

std::vector<ScaleExtremum> scale_extrema(const Octave& octave, int scale, double peak_threshold,
                                         double edge_threshold) {
  const Differences differences(octave, scale);
  // What falls short by a fifth at its sample may reach it between samples.
  const auto least = static_cast<float>(0.8 * peak_threshold);
  std::vector<ScaleExtremum> found;
  const int width = octave.width();
  for (int y = 1; y + 1 < octave.height(); ++y) {
    for (int x0 = 1; x0 + 1 < width; x0 += 8) {
      const unsigned candidates = differences.candidates(x0, y, least);
      for (int lane = 0; lane < 8 && x0 + lane + 1 < width && candidates >> lane != 0; ++lane) {
        const int x = x0 + lane;
        if ((candidates >> lane & 1u) == 0 || !differences.is_extremum(x, y)) continue;
        if (const auto peak = refined(differences, x, y, scale, peak_threshold, edge_threshold))
          found.push_back(*peak);
      }
    }
  }
  return found;
}

}  // namespace orbitfuse
