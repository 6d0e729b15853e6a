// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/pyramid/pyramid.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace orbitfuse::fusion {

int pyramid_levels(cv::Size size, int wanted, int min_base_px) {
  int levels = 0;
  for (int side = std::min(size.width, size.height);
       levels < wanted && (side + 1) / 2 >= min_base_px; side = (side + 1) / 2)
    ++levels;
  return levels;
}

std::vector<Plane> gaussian_pyramid(const Plane& image, int levels) {
  std::vector<Plane> planes = {image};
  for (int i = 0; i < levels; ++i) {
    Plane reduced;
    cv::pyrDown(planes.back(), reduced);
    planes.push_back(reduced);
  }
  return planes;
}

LaplacianPyramid laplacian_pyramid(const Plane& image, int levels) {
  const std::vector<Plane> planes = gaussian_pyramid(image, levels);
  LaplacianPyramid pyramid;
  for (int i = 0; i < levels; ++i) {
    const auto k = static_cast<std::size_t>(i);
    Plane expanded;
    cv::pyrUp(planes[k + 1], expanded, planes[k].size());
    pyramid.bands.push_back(planes[k] - expanded);
  }
  pyramid.base = planes.back();
  return pyramid;
}

Plane collapse(const LaplacianPyramid& pyramid) {
  Plane image = pyramid.base;
  for (auto band = pyramid.bands.rbegin(); band != pyramid.bands.rend(); ++band) {
    Plane expanded;
    cv::pyrUp(image, expanded, band->size());
    image = expanded + *band;
  }
  return image;
}

}  // namespace orbitfuse::fusion
