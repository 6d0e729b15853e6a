// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/float_temperatures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "core/image/image_io.hpp"
#include "core/image/samples.hpp"
#include "core/numeric/median.hpp"
#include "core/temperature.hpp"

namespace orbitfuse {
namespace {

constexpr float least_median_k = 173.15f;  ///< -100 C: no scene's half is colder
constexpr float least_median_c = -100;
/// What the coarsest stored scale holds.
const double most_k = 65534 * stored_kelvin_per_count.back();

}  // namespace

Result<FloatTemperatures> float_temperatures(const cv::Mat& values, const std::string& where) {
  CV_Assert(values.type() == CV_32FC1);
  std::vector<float> samples;
  append_finite(values, samples);
  std::erase_if(samples, [](float v) { return !(v > -celsius_zero_k); });
  const char* remedy = "store 100 x kelvin as 16-bit (0 where there is none)";
  if (samples.empty())
    return fail(ErrorKind::input, where, "32-bit floats without one temperature", remedy);
  const float median = median_in(samples);
  const bool is_kelvin = median >= least_median_k;
  if (median < least_median_c || median > most_k)
    return fail(
        ErrorKind::input, where,
        fmt::format("32-bit floats with a median of {:g}: neither kelvin nor Celsius", median),
        remedy);
  FloatTemperatures out;
  out.unit = is_kelvin ? "kelvin" : "Celsius";
  const cv::Mat kelvin = is_kelvin ? values : cv::Mat(values + celsius_zero_k);
  // What no scale holds (1e30, a program's word for none) must not coarsen it for the others.
  double hottest_k = 0;
  for (const float v : samples) {
    const double k = is_kelvin ? v : kelvin_from_celsius(v);
    if (k <= most_k) hottest_k = std::max(hottest_k, k);
  }
  // The last count of a file means "that or more": a step for which it is left free.
  out.scale.scale = kelvin_per_count_for(hottest_k * 65535 / 65534);
  out.counts = counts_of_kelvin(kelvin, out.scale.scale);
  cv::Mat finite;  // infinity is no temperature, as NaN is
  cv::inRange(kelvin, most_k, std::numeric_limits<float>::max(), finite);
  out.counts.setTo(65535, finite);
  return out;
}

}  // namespace orbitfuse
