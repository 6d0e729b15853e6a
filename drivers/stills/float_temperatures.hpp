// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/image/temperature_unit.hpp"

namespace orbitfuse {

/// What 32-bit floats without a word on their unit can be; the values index arrays.
enum class FloatUnit { kelvin = 0, celsius = 1 };
const char* name(FloatUnit unit);

/// Of the numbers of an image that can be temperatures: finite, above -273.15, and not 0, which is
/// a mask more often than a temperature.
struct FloatSummary {
  float cold = 0, middle = 0;         ///< 5 and 50 % of them are less
  std::array<double, 2> hottest_k{};  ///< read in each unit, of those that a stored scale holds

  double cold_k(FloatUnit unit) const;
  double middle_k(FloatUnit unit) const;
};
/// Of CV_32FC1; nothing without one such number.
std::optional<FloatSummary> summary_of(const cv::Mat& values);
/// Whether the middle can be a temperature in either unit.
bool is_kelvin_or_celsius(const FloatSummary& summary);

/// Numbers in the unit as kelvin, others as they are.
cv::Mat kelvin_of_floats(const cv::Mat& values, FloatUnit unit);

/// Which unit files have that name none: one for all of an image size (a camera's), however it was
/// held. 173 and more may be kelvin (from -100 C on) or Celsius of something hot; less is Celsius.
/// Celsius where half of the files' middles are less, or any is while the others would be a scene
/// of less than -40 C as kelvin. The unit is to be shown to the user.
class FloatUnits {
 public:
  void observe(const FloatSummary& summary, cv::Size size, const std::string& where);

  // After all observations:
  FloatUnit unit_of(cv::Size size) const;
  /// Of files that are no colder than `coldest_k`, as convert() will take them; 0 without one.
  double hottest_k(double coldest_k) const;
  /// What was taken for what, in words, and what doubts are left.
  std::vector<std::string> told() const;
  /// Names of files whose middle is hotter than that.
  std::vector<std::string> hotter_than(double kelvin) const;

 private:
  struct Set {
    std::vector<FloatSummary> summaries;
    std::vector<std::string> names;
    FloatUnit unit() const;
    std::size_t could_be_kelvin() const;
  };
  static std::pair<int, int> key(cv::Size size);
  std::map<std::pair<int, int>, Set> sets_;
};

}  // namespace orbitfuse
