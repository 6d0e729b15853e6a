// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "app/comparison/comparison.hpp"

namespace orbitfuse::comparison {

/// One span of colours for all that a comparison shows: blue is colder, white alike, red warmer.
class DifferenceColors {
 public:
  inline static const cv::Vec3b changed{200, 0, 200};  ///< BGR, of another surface

  /// The span reaches to the largest region's peak, and never below what is worth a line.
  explicit DifferenceColors(const Comparison& comparison);
  cv::Vec3b of(float difference_k) const;  ///< gray where nothing is said
  /// How strongly it is laid over a picture, 0..0.85: nothing of what noise alone makes.
  double strength(float difference_k) const;
  double reach_k() const { return reach_k_; }

 private:
  double reach_k_, noise_k_;
};

struct ComparedPicture {
  std::string view;
  cv::Mat image;  ///< BGR
};

/// The page, of differences.json's content.
std::string comparison_page(const nlohmann::json& numbers, const DifferenceColors& colors,
                            const std::vector<ComparedPicture>& pictures);

}  // namespace orbitfuse::comparison
