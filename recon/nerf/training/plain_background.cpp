// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/plain_background.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <opencv2/imgproc.hpp>

#include "core/system/parallel.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr float same_color = 3.5F / 255;
constexpr double border_share = 0.7;  ///< of a view's border
constexpr double views_share = 0.9;
constexpr int least_views = 3;  ///< two silhouettes bound nothing

std::vector<cv::Vec3f> border_of(const cv::Mat& image) {
  std::vector<cv::Vec3f> out;
  for (int x = 0; x < image.cols; ++x)
    for (const int y : {0, image.rows - 1}) out.push_back(image.at<cv::Vec3f>(y, x));
  for (int y = 1; y + 1 < image.rows; ++y)
    for (const int x : {0, image.cols - 1}) out.push_back(image.at<cv::Vec3f>(y, x));
  return out;
}

cv::Vec3f median_of(std::vector<cv::Vec3f> colors) {
  cv::Vec3f out;
  const auto middle = colors.begin() + static_cast<std::ptrdiff_t>(colors.size() / 2);
  for (int c = 0; c < 3; ++c) {
    std::nth_element(colors.begin(), middle, colors.end(),
                     [c](const auto& a, const auto& b) { return a[c] < b[c]; });
    out[c] = (*middle)[c];
  }
  return out;
}

bool is(const cv::Vec3f& background, const cv::Vec3f& color) {
  return cv::norm(background, color, cv::NORM_INF) <= same_color;
}

cv::Mat clearance_of(const cv::Mat& image, const cv::Vec3f& color) {
  // A frame of one pixel joins what touches the border anywhere.
  cv::Mat same(image.rows + 2, image.cols + 2, CV_8UC1, cv::Scalar(1)), labels, clearance;
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      same.at<std::uint8_t>(y + 1, x + 1) = is(color, image.at<cv::Vec3f>(y, x)) ? 1 : 0;
  cv::connectedComponents(same, labels, 4, CV_32S);
  const cv::Mat outside = labels == labels.at<int>(0, 0);
  if (cv::countNonZero(outside) == static_cast<int>(outside.total()))
    clearance = cv::Mat(outside.size(), CV_8UC1, cv::Scalar(255));  // nothing to be far from
  else
    cv::distanceTransform(outside, clearance, cv::DIST_L2, cv::DIST_MASK_5);
  clearance.convertTo(clearance, CV_8UC1);
  return clearance(cv::Rect(1, 1, image.cols, image.rows)).clone();
}

/// Half the side of the cube that fit_to_silhouettes() looks into, in cells.
constexpr int half_cells = 32;

}  // namespace

std::optional<PlainBackground> find_plain_background(const Dataset& dataset) {
  const std::vector<TrainingView>& views = dataset.views;
  if (dataset.modality != Modality::visible || views.size() < least_views) return std::nullopt;
  PlainBackground out;
  std::vector<cv::Vec3f> medians;
  std::vector<std::vector<cv::Vec3f>> borders;
  for (const TrainingView& view : views) {
    borders.push_back(border_of(view.image));
    medians.push_back(median_of(borders.back()));
  }
  out.color = median_of(medians);
  const auto shows_it = [&](const std::vector<cv::Vec3f>& border) {
    const auto alike = std::count_if(border.begin(), border.end(),
                                     [&](const auto& color) { return is(out.color, color); });
    return static_cast<double>(alike) >= border_share * static_cast<double>(border.size());
  };
  if (static_cast<double>(std::count_if(borders.begin(), borders.end(), shows_it)) <
      views_share * static_cast<double>(views.size()))
    return std::nullopt;
  out.clearance_px.resize(views.size());
  parallel_for(static_cast<int>(views.size()), [&](int i) {
    const auto view = static_cast<std::size_t>(i);
    out.clearance_px[view] = clearance_of(views[view].image, out.color);
  });
  double empty = 0, all = 0;
  for (const cv::Mat& clearance : out.clearance_px) {
    empty += cv::countNonZero(clearance);
    all += static_cast<double>(clearance.total());
  }
  out.share = empty / all;
  return out;
}

Sighting sighting_of(const std::vector<Silhouette>& views, const float point[3], float radius) {
  const auto share = [](std::size_t of) { return std::max<std::size_t>(2, (of + 9) / 10); };
  std::size_t seen = 0, empty = 0;
  for (const Silhouette& view : views) {
    double x, y, z;
    if (!view.rays->project(point, x, y, z)) continue;
    ++seen;
    const double reach_px = radius / z / view.rays->pixel_angle();
    const auto clear_px =
        view.clearance_px->at<std::uint8_t>(static_cast<int>(y), static_cast<int>(x));
    if (clear_px > reach_px && ++empty >= share(views.size())) return Sighting::empty;
  }
  if (empty >= share(seen)) return Sighting::empty;
  return 2 * seen < views.size() ? Sighting::unseen : Sighting::matter;
}

namespace {

Space fit_once(const PlainBackground& background, const Dataset& dataset, const Space& space) {
  std::vector<ViewRays> rays;
  std::vector<Silhouette> views;
  rays.reserve(dataset.views.size());
  for (std::size_t i = 0; i < dataset.views.size(); ++i) {
    rays.emplace_back(dataset.views[i].camera, dataset.views[i].cam_from_world, space);
    views.push_back({&rays.back(), &background.clearance_px[i]});
  }
  const float size = 1.0F / half_cells, half_diagonal = 0.87F * size;
  std::vector<Eigen::AlignedBox3f> boxes(2 * half_cells);
  std::atomic<bool> beyond = false;
  parallel_for(2 * half_cells, [&](int slab) {
    const auto at = [&](int i) { return (static_cast<float>(i - half_cells) + 0.5F) * size; };
    for (int y = 0; y < 2 * half_cells && !beyond; ++y)
      for (int x = 0; x < 2 * half_cells; ++x) {
        const Eigen::Vector3f point(at(x), at(y), at(slab));
        if (sighting_of(views, point.data(), half_diagonal) != Sighting::matter) continue;
        if (point.norm() > 0.95F) beyond = true;
        boxes[static_cast<std::size_t>(slab)].extend(point);
      }
  });
  Eigen::AlignedBox3f box;
  for (const Eigen::AlignedBox3f& part : boxes) box.extend(part);
  if (beyond || box.isEmpty()) return space;
  const double radius = 0.5 * box.diagonal().norm() + half_diagonal;
  if (radius >= 1) return space;
  return {space.center + space.radius * box.center().cast<double>(), space.radius * radius};
}

}  // namespace

Space fit_to_silhouettes(const PlainBackground& background, const Dataset& dataset,
                         const Space& space) {
  // Again, with cells as small as the first ball allows.
  return fit_once(background, dataset, fit_once(background, dataset, space));
}

}  // namespace orbitfuse::nerf
