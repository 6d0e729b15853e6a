// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/training/dead_leaves.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace orbitfuse::fusion {
namespace {

/// Noise of one grain size, mean 0, about -1..1.
Plane grain(cv::Size size, double grain_px, std::mt19937& random) {
  const int columns = std::max(2, static_cast<int>(size.width / grain_px)),
            rows = std::max(2, static_cast<int>(size.height / grain_px));
  Plane coarse(rows, columns), fine;
  for (float& v : coarse) v = static_cast<float>(uniform(random, -1, 1));
  cv::resize(coarse, fine, size, 0, 0, cv::INTER_CUBIC);
  return fine;
}

cv::Mat1b leaf(cv::Size size, cv::Point center, double radius, std::mt19937& random) {
  cv::Mat1b mask = cv::Mat1b::zeros(size);
  const double angle = uniform(random, 0, 360), aspect = uniform(random, 0.3, 1);
  const cv::Size2d axes(radius, radius * aspect);
  if (uniform(random, 0, 1) < 0.5) {
    cv::ellipse(mask,
                cv::RotatedRect(center, cv::Size2d(2 * axes.width, 2 * axes.height),
                                static_cast<float>(angle)),
                255, cv::FILLED, cv::LINE_AA);
  } else {
    cv::Point2f corners[4];
    cv::RotatedRect(center, cv::Size2d(2 * axes.width, 2 * axes.height), static_cast<float>(angle))
        .points(corners);
    std::vector<cv::Point> polygon(corners, corners + 4);
    cv::fillConvexPoly(mask, polygon, 255, cv::LINE_AA);
  }
  return mask;
}

}  // namespace

double uniform(std::mt19937& random, double low, double high) {
  return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
}

Plane dead_leaves(cv::Size size, std::uint32_t seed) {
  std::mt19937 random(seed);
  const Plane grains[3] = {grain(size, 1, random), grain(size, 3, random), grain(size, 9, random)};
  Plane image(size, static_cast<float>(uniform(random, 0, 255)));
  constexpr double smallest = 3, largest = 90;
  for (int i = 0; i < 700; ++i) {
    // Cubic law of sizes: the image looks alike at every scale.
    const double u = uniform(random, 0, 1);
    const double radius =
        smallest / std::sqrt(1 - u * (1 - (smallest / largest) * (smallest / largest)));
    const cv::Point center(static_cast<int>(uniform(random, 0, size.width)),
                           static_cast<int>(uniform(random, 0, size.height)));
    const auto reach = static_cast<int>(1.5 * radius) + 2;
    const cv::Rect box =
        cv::Rect(center.x - reach, center.y - reach, 2 * reach, 2 * reach) & cv::Rect({}, size);
    if (box.empty()) continue;
    const cv::Mat1b mask = leaf(box.size(), center - box.tl(), radius, random);
    const double shade = uniform(random, 0, 255),
                 strength = std::pow(uniform(random, 0, 1), 3) * 60;
    const double gx = uniform(random, -0.6, 0.6), gy = uniform(random, -0.6, 0.6);
    const Plane texture = grains[random() % 3](box);
    for (int y = 0; y < box.height; ++y)
      for (int x = 0; x < box.width; ++x) {
        const float a = static_cast<float>(mask(y, x)) / 255;
        const auto v =
            static_cast<float>(shade + gx * (x - box.width / 2.0) + gy * (y - box.height / 2.0)) +
            static_cast<float>(strength) * texture(y, x);
        float& pixel = image(box.y + y, box.x + x);
        pixel += a * (std::clamp(v, 0.0F, 255.0F) - pixel);
      }
  }
  return image;
}

}  // namespace orbitfuse::fusion
