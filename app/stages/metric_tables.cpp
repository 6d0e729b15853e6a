// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/metric_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace orbitfuse::stages {
using nlohmann::json;

void MetricMeans::add(const std::string& group, const std::string& image,
                      const std::vector<MetricValue>& values) {
  rows_.push_back({group, image, values});
}

std::vector<std::string> MetricMeans::groups() const {
  std::vector<std::string> names;
  for (const Row& row : rows_)
    if (std::find(names.begin(), names.end(), row.group) == names.end()) names.push_back(row.group);
  return names;
}

double MetricMeans::mean(const std::string& group, std::size_t metric) const {
  double sum = 0;
  int count = 0;
  for (const Row& row : rows_) {
    if (row.group != group) continue;
    sum += row.values[metric].value;
    ++count;
  }
  return sum / count;
}

json MetricMeans::to_json() const {
  json result = json::object();
  for (const std::string& group : groups())
    for (std::size_t m = 0; m < rows_[0].values.size(); ++m)
      result[group][rows_[0].values[m].name] = mean(group, m);
  return result;
}

json MetricMeans::table(const std::string& title, const std::string& group_name) const {
  json columns = json::array({json::array({group_name, ""})}), rows = json::array();
  for (const MetricValue& value : rows_[0].values)
    columns.push_back(json::array({value.name, value.definition}));
  for (const std::string& group : groups()) {
    json row = json::array({group});
    for (std::size_t m = 0; m < rows_[0].values.size(); ++m)
      row.push_back(fmt::format("{:.4g}", mean(group, m)));
    rows.push_back(std::move(row));
  }
  return {{"title", title}, {"columns", columns}, {"rows", rows}};
}

std::string MetricMeans::csv() const {
  std::string text;
  for (const Row& row : rows_)
    for (const MetricValue& value : row.values)
      text += fmt::format("{},{},{},{}\n", row.group, row.image, value.name, value.value);
  return text;
}

void take_out_alike(double share, std::vector<MetricValue>& values) {
  for (MetricValue& value : values) {
    if (value.name == "PSNR") value.value += 10 * std::log10(1 - share);
    if (value.name == "SSIM" || value.name == "hist")
      value.value = (value.value - share) / (1 - share);
  }
}

cv::Mat gray_of_kelvin(const cv::Mat& kelvin, TemperatureSpan span) {
  cv::Mat gray(kelvin.size(), CV_8U), valid = kelvin == kelvin;
  const double scale = 255.0 / (span.high_k - span.low_k);
  kelvin.convertTo(gray, CV_8U, scale, -span.low_k * scale);
  gray.setTo(0, ~valid);
  return gray;
}

}  // namespace orbitfuse::stages
