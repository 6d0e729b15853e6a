// SPDX-License-Identifier: BSD-3-Clause
#include "recon/alignment/patch_matching.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "recon/alignment/edge_correlation.hpp"
#include "recon/alignment/edge_field.hpp"

namespace orbitfuse {
namespace {

/// Of an edge of brightness against one of depth: form shows in both modalities, paint perhaps.
constexpr float paint_weight = 0.6F;

/// Edge pixels by the row they lie in.
class PixelRows {
 public:
  PixelRows(const std::vector<EdgePixel>& pixels, int rows) {
    auto first = pixels.begin();
    for (int y = 0; y <= rows; ++y) {
      while (first != pixels.end() && first->y < y) ++first;
      begins_.push_back(first);
    }
  }
  /// Those in the square of `radius` round a pixel, in their order.
  std::vector<EdgePixel> around(int cx, int cy, int radius) const {
    std::vector<EdgePixel> found;
    const int rows = static_cast<int>(begins_.size()) - 1;
    for (int y = std::max(0, cy - radius); y <= std::min(rows - 1, cy + radius); ++y) {
      const auto begin = begins_[static_cast<std::size_t>(y)],
                 end = begins_[static_cast<std::size_t>(y) + 1];
      const auto first =
          std::partition_point(begin, end, [&](const EdgePixel& p) { return p.x < cx - radius; });
      const auto last =
          std::partition_point(first, end, [&](const EdgePixel& p) { return p.x <= cx + radius; });
      found.insert(found.end(), first, last);
    }
    return found;
  }

 private:
  std::vector<std::vector<EdgePixel>::const_iterator> begins_;  ///< of each row, and the end
};

double strength_squared(const std::vector<EdgePixel>& pixels) {
  double sum = 0;
  for (const EdgePixel& p : pixels)
    sum += static_cast<double>(p.strength) * static_cast<double>(p.strength);
  return sum;
}

/// Peak to a fraction of a pixel, and the curvature of the score there.
struct Peak {
  Eigen::Vector2d shift;
  Eigen::Matrix2d curvature;  ///< minus the Hessian, positive definite at a true peak
  double value = 0;
  bool inside = false;  ///< not on the border of the search
};

Peak peak_of(const cv::Mat1f& score, int reach) {
  cv::Point at;
  double value = 0;
  cv::minMaxLoc(score, nullptr, &value, nullptr, &at);
  Peak peak;
  peak.value = value;
  peak.shift = Eigen::Vector2d(at.x - reach, at.y - reach);
  peak.curvature.setZero();
  peak.inside = at.x > 0 && at.y > 0 && at.x < 2 * reach && at.y < 2 * reach;
  if (!peak.inside) return peak;
  const auto s = [&](int dx, int dy) { return static_cast<double>(score(at.y + dy, at.x + dx)); };
  const double xx = s(1, 0) - 2 * s(0, 0) + s(-1, 0), yy = s(0, 1) - 2 * s(0, 0) + s(0, -1);
  const double xy = (s(1, 1) - s(1, -1) - s(-1, 1) + s(-1, -1)) / 4;
  peak.curvature << -xx, -xy, -xy, -yy;
  const Eigen::Vector2d gradient((s(1, 0) - s(-1, 0)) / 2, (s(0, 1) - s(0, -1)) / 2);
  if (peak.curvature.determinant() > 1e-6 * peak.curvature.squaredNorm() &&
      peak.curvature.trace() > 0) {
    const Eigen::Vector2d step = peak.curvature.inverse() * gradient;
    if (step.cwiseAbs().maxCoeff() <= 1) peak.shift += step;
  }
  return peak;
}

/// Depth of what an edge belongs to: the nearest surface beside it.
double near_depth(const cv::Mat& depth, int x, int y) {
  double nearest = std::numeric_limits<double>::infinity();
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx) {
      const int u = x + dx, v = y + dy;
      if (u < 0 || v < 0 || u >= depth.cols || v >= depth.rows) continue;
      const auto z = static_cast<double>(depth.at<float>(v, u));
      if (z > 0 && z < nearest) nearest = z;
    }
  return nearest;
}

}  // namespace

cv::Mat rendered_edges(const SceneRender& render) {
  // Inverse depth: equal steps look alike near and far, and what has no depth is infinitely far.
  cv::Mat inverse(render.depth.size(), CV_32F);
  for (int y = 0; y < inverse.rows; ++y)
    for (int x = 0; x < inverse.cols; ++x) {
      const float z = render.depth.at<float>(y, x);
      inverse.at<float>(y, x) = z > 0 ? 1 / z : 0;
    }
  const cv::Mat form = orientation_field(inverse, 1.0),
                shade = orientation_field(render.brightness, 1.0);
  cv::Mat edges = form.clone();
  for (int y = 0; y < edges.rows; ++y)
    for (int x = 0; x < edges.cols; ++x) {
      auto& f = edges.at<cv::Vec2f>(y, x);
      const auto s = paint_weight * shade.at<cv::Vec2f>(y, x);
      if (s.dot(s) > f.dot(f)) f = s;
    }
  return edges;
}

std::vector<PatchMatch> match_patches(const SceneRender& render, const cv::Mat& edges,
                                      const Camera& camera, const cv::Mat& field,
                                      const PatchMatchOptions& options) {
  const std::vector<EdgePixel> all = edge_pixels(edges, 0.25F);
  std::vector<PatchMatch> matches;
  if (all.size() < 20) return matches;
  const FieldPlanes planes(field, options.search_px + options.patch_search_px + 1);
  const Peak whole = peak_of(planes.correlation(all, 0, 0, options.search_px), options.search_px);
  const int sx = static_cast<int>(std::lround(whole.shift.x())),
            sy = static_cast<int>(std::lround(whole.shift.y()));
  const int r = options.radius_px;
  const PixelRows rows(all, edges.rows);
  for (int cy = options.spacing_px / 2; cy < edges.rows; cy += options.spacing_px)
    for (int cx = options.spacing_px / 2; cx < edges.cols; cx += options.spacing_px) {
      const std::vector<EdgePixel> patch = rows.around(cx, cy, r);
      if (patch.size() < 12) continue;
      const Peak peak = peak_of(planes.correlation(patch, sx, sy, options.patch_search_px),
                                options.patch_search_px);
      if (!peak.inside || !(peak.value > 0)) continue;
      // Normalised by the image's own strength under the patch's edge pixels.
      double there = 0;
      const Eigen::Vector2d shift = peak.shift + Eigen::Vector2d(sx, sy);
      for (const EdgePixel& p : patch) {
        there += static_cast<double>(planes.energy(p.x + static_cast<int>(std::lround(shift.x())),
                                                   p.y + static_cast<int>(std::lround(shift.y()))));
      }
      const double score = peak.value / std::sqrt(std::max(1e-9, there * strength_squared(patch)));
      // Edges that the image shows only faintly must not count as a perfect match.
      const double coverage = std::sqrt(there / strength_squared(patch));
      if (score < options.min_score || coverage < 0.2) continue;
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(peak.curvature);
      const Eigen::Vector2d values = eigen.eigenvalues().cwiseMax(0);
      if (!(values.maxCoeff() > 0)) continue;
      const Eigen::Matrix2d root = eigen.eigenvectors() *
                                   (values / values.maxCoeff()).cwiseSqrt().asDiagonal() *
                                   eigen.eigenvectors().transpose();
      // The strongest edge pixel nearest to the patch's centre stands for it.
      const EdgePixel* anchor = nullptr;
      double best = -1;
      for (const EdgePixel& p : patch) {
        const double distance = std::hypot(p.x - cx, p.y - cy);
        const double value = static_cast<double>(p.strength) / (1 + distance / r);
        if (value > best && std::isfinite(near_depth(render.depth, p.x, p.y)))
          best = value, anchor = &p;
      }
      if (!anchor) continue;
      const Eigen::Vector2d pixel(anchor->x + 0.5, anchor->y + 0.5);
      matches.push_back({camera.ray_of(pixel) * near_depth(render.depth, anchor->x, anchor->y),
                         pixel + shift, root, score * std::min(1.0, coverage)});
    }
  return matches;
}

double edge_agreement(const cv::Mat& edges, const cv::Mat& field) {
  double sum = 0, total = 0;
  for (const EdgePixel& p : edge_pixels(edges, 0.25F)) {
    const auto& v = field.at<cv::Vec2f>(p.y, p.x);
    sum += static_cast<double>(p.re * v[0] + p.im * v[1]) / static_cast<double>(p.strength);
    total += 1;
  }
  return total > 0 ? sum / total : 0;
}

}  // namespace orbitfuse
