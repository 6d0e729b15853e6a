// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/float_temperatures.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/image/samples.hpp"
#include "core/numeric/median.hpp"
#include "core/temperature.hpp"

namespace orbitfuse {
namespace {

constexpr float least_median_k = 173.15f;  ///< -100 C: no scene's half is colder
constexpr float least_median_c = -100;
constexpr float cold_scene_k = 233.15f;  ///< -40 C: colder than what people go out to record
/// What the coarsest stored scale holds.
const double most_k = 65535 * stored_kelvin_per_count.back();

double kelvin_of_float(double number, FloatUnit unit) {
  return unit == FloatUnit::celsius ? kelvin_from_celsius(number) : number;
}

}  // namespace

const char* name(FloatUnit unit) { return unit == FloatUnit::celsius ? "Celsius" : "kelvin"; }

double FloatSummary::cold_k(FloatUnit unit) const {
  return kelvin_of_float(static_cast<double>(cold), unit);
}
double FloatSummary::middle_k(FloatUnit unit) const {
  return kelvin_of_float(static_cast<double>(middle), unit);
}

std::optional<FloatSummary> summary_of(const cv::Mat& values) {
  CV_Assert(values.type() == CV_32FC1);
  std::vector<float> samples;
  append_finite(values, samples);
  std::erase_if(samples, [](float v) { return !(v > -celsius_zero_k) || v == 0; });
  if (samples.empty()) return std::nullopt;
  FloatSummary out;
  // What no scale holds (1e30, a program's word for none) must not coarsen it for the others.
  for (const FloatUnit unit : {FloatUnit::kelvin, FloatUnit::celsius}) {
    double& hottest = out.hottest_k[static_cast<std::size_t>(unit)];
    for (const float v : samples)
      if (const double k = kelvin_of_float(static_cast<double>(v), unit); k <= most_k)
        hottest = std::max(hottest, k);
  }
  out.middle = median_in(samples);
  const auto cold = samples.begin() + static_cast<std::ptrdiff_t>((samples.size() - 1) / 20);
  std::nth_element(samples.begin(), cold, samples.end());
  out.cold = *cold;
  return out;
}

bool is_kelvin_or_celsius(const FloatSummary& summary) {
  return summary.middle >= least_median_c && static_cast<double>(summary.middle) <= most_k;
}

cv::Mat kelvin_of_floats(const cv::Mat& values, FloatUnit unit) {
  return unit == FloatUnit::celsius ? cv::Mat(values + celsius_zero_k) : values;
}

std::pair<int, int> FloatUnits::key(cv::Size size) { return std::minmax(size.width, size.height); }

void FloatUnits::observe(const FloatSummary& summary, cv::Size size, const std::string& where) {
  if (!is_kelvin_or_celsius(summary)) return;  // whoever converts it says so
  Set& set = sets_[key(size)];
  set.summaries.push_back(summary);
  set.names.push_back(where);
}

std::size_t FloatUnits::Set::could_be_kelvin() const {
  return static_cast<std::size_t>(
      std::count_if(summaries.begin(), summaries.end(),
                    [](const FloatSummary& s) { return s.middle >= least_median_k; }));
}

FloatUnit FloatUnits::Set::unit() const {
  std::vector<float> high;
  for (const FloatSummary& s : summaries)
    if (s.middle >= least_median_k) high.push_back(s.middle);
  if (high.size() == summaries.size()) return FloatUnit::kelvin;
  const bool half_is_low = 2 * high.size() <= summaries.size();
  return half_is_low || median_in(high) < cold_scene_k ? FloatUnit::celsius : FloatUnit::kelvin;
}

FloatUnit FloatUnits::unit_of(cv::Size size) const {
  const auto set = sets_.find(key(size));
  return set == sets_.end() ? FloatUnit::kelvin : set->second.unit();
}

double FloatUnits::hottest_k(double coldest_k) const {
  double hottest = 0;
  for (const auto& [size, set] : sets_) {
    const FloatUnit unit = set.unit();
    for (const FloatSummary& s : set.summaries)
      if (s.cold_k(unit) >= coldest_k)
        hottest = std::max(hottest, s.hottest_k[static_cast<std::size_t>(unit)]);
  }
  return hottest;
}

std::vector<std::string> FloatUnits::told() const {
  std::vector<std::string> list;
  for (const auto& [size, set] : sets_) {
    std::string words =
        fmt::format("{}{}: 32-bit floats, read as {}", set.names.front(),
                    set.names.size() == 1 ? "" : fmt::format(" and {} more", set.names.size() - 1),
                    name(set.unit()));
    const std::size_t high = set.could_be_kelvin();
    if (high > 0 && high < set.names.size())
      words += fmt::format(
          ", all of one unit, though by themselves {} of {} would be kelvin and the others "
          "Celsius: "
          "if they are not, name the unit in their tags or sidecars ({{\"unit\": \"kelvin\"}})",
          high, set.names.size());
    list.push_back(std::move(words));
  }
  return list;
}

std::vector<std::string> FloatUnits::hotter_than(double kelvin) const {
  std::vector<std::string> list;
  for (const auto& [size, set] : sets_)
    for (std::size_t i = 0; i < set.names.size(); ++i)
      if (set.summaries[i].middle_k(set.unit()) > kelvin) list.push_back(set.names[i]);
  return list;
}

}  // namespace orbitfuse
