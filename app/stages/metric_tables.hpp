// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/image/palette.hpp"
#include "fusion/metrics/metrics.hpp"

namespace orbitfuse::stages {

/// Metric values of several images, by group (a fusion method, a field), with their means.
class MetricMeans {
 public:
  void add(const std::string& group, const std::string& image,
           const std::vector<MetricValue>& values);

  bool empty() const { return rows_.empty(); }
  std::size_t count() const { return rows_.size(); }
  /// {group: {metric: mean}}
  nlohmann::json to_json() const;
  /// As the report takes tables: title, columns with definitions, one row a group.
  nlohmann::json table(const std::string& title, const std::string& group_name) const;
  /// "group,image,metric,value" lines, full precision.
  static std::string csv_header() { return "group,image,metric,value\n"; }
  std::string csv() const;

 private:
  struct Row {
    std::string group, image;
    std::vector<MetricValue> values;
  };
  std::vector<std::string> groups() const;
  double mean(const std::string& group, std::size_t metric) const;
  std::vector<Row> rows_;
};

/// Kelvin over the span as CV_8UC1; NaN becomes 0.
/// Brings metrics of a pair that was made alike in a share of its pixels, for they are dead in the
/// truth, to what they are of the others: PSNR by the mean of squares, SSIM and histogram
/// intersection, which count what is alike as 1, by the mean. Of the others it says nothing.
void take_out_alike(double share, std::vector<MetricValue>& values);

cv::Mat gray_of_kelvin(const cv::Mat& kelvin, TemperatureSpan span);

}  // namespace orbitfuse::stages
