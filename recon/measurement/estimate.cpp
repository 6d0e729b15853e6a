// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/estimate.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/numeric/median.hpp"

namespace orbitfuse::measurement {
namespace {

constexpr double outlier_sigmas = 3;
/// Two readings that differ don't tell which is right, nor do many against many.
constexpr std::size_t fewest_to_reject = 3;
constexpr double most_rejected = 0.25;  // of the weight

double squared(double x) { return x * x; }

}  // namespace

double weighted_median(std::vector<std::pair<double, double>> list) {
  assert(!list.empty());
  std::sort(list.begin(), list.end());
  double total = 0, below = 0;
  for (const auto& [value, weight] : list) total += weight;
  for (const auto& [value, weight] : list) {
    below += weight;
    if (below >= 0.5 * total) return value;
  }
  return list.back().first;
}

bool Agreement::all_near() const {
  return std::all_of(near.begin(), near.end(), [](bool is) { return is; });
}

Agreement agreement_of(const std::vector<WeightedReading>& readings,
                       const MeasurementOptions& options) {
  std::vector<std::pair<double, double>> values, deviations;
  for (const WeightedReading& r : readings) values.emplace_back(r.temperature_k, r.weight);
  const double middle = weighted_median(values);
  for (const auto& [value, weight] : values)
    deviations.emplace_back(std::abs(value - middle), weight);
  // Frames see a place with different samples, whose fixed pattern and vignetting differ.
  const double sigma = std::max(sigma_of_median * weighted_median(deviations),
                                std::hypot(options.noise_sigma_k, options.common_sigma_k));
  Agreement result;
  double total = 0, rejected = 0;
  for (const WeightedReading& r : readings) {
    const double expected = std::hypot(sigma, options.pose_sigma_px * r.gradient_k_per_px);
    result.near.push_back(std::abs(r.temperature_k - middle) <= outlier_sigmas * expected);
    total += r.weight;
    rejected += result.near.back() ? 0 : r.weight;
  }
  result.two_camps =
      rejected > 0 && (readings.size() < fewest_to_reject || rejected > most_rejected * total);
  return result;
}

Estimate estimate(const std::vector<WeightedReading>& readings, const Agreement& agreement,
                  const FieldReading& field, const MeasurementOptions& options) {
  assert(agreement.near.size() == readings.size());
  const double middle = readings.front().temperature_k;  // sums of kelvin would lose digits
  double sum = 0, mean = 0, squares = 0, gradient = 0;
  int count = 0;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const WeightedReading& r = readings[i];
    if (!agreement.uses(i)) continue;
    sum += r.weight;
    mean += r.weight * (r.temperature_k - middle);
    squares += r.weight * r.weight;
    gradient += r.weight * squared(r.gradient_k_per_px);
    ++count;
  }
  Estimate result;
  result.temperature_k = middle + mean / sum;
  double deviation = 0;
  for (std::size_t i = 0; i < readings.size(); ++i)
    if (agreement.uses(i))
      deviation +=
          readings[i].weight / sum * squared(readings[i].temperature_k - result.temperature_k);
  const double effective = sum * sum / squares;  // frames of equal weight that say as much
  result.spread_k = count < 2 ? std::numeric_limits<double>::quiet_NaN()
                              : std::sqrt(deviation * count / (count - 1));
  const double single = std::max(count < 2 ? 0 : result.spread_k, options.noise_sigma_k);
  // One of two camps is right: more frames in both don't bring their mean nearer to it.
  result.statistical_k = agreement.two_camps ? single : single / std::sqrt(effective);
  result.gradient_k = options.pose_sigma_px * std::sqrt(gradient / sum);
  result.variation_k = field.variation_k;
  result.disagreement_k =
      std::isfinite(field.temperature_k) ? std::abs(field.temperature_k - result.temperature_k) : 0;
  const double variance = squared(options.common_sigma_k * field.gain) +
                          squared(options.statistical_share * result.statistical_k) +
                          squared(options.gradient_share * result.gradient_k) +
                          squared(options.disagreement_share * result.disagreement_k) +
                          squared(options.variation_share * result.variation_k);
  result.assumed_k = options.coverage_factor * options.common_sigma_k * field.gain;
  result.uncertainty_k = options.coverage_factor * std::sqrt(variance);
  return result;
}

}  // namespace orbitfuse::measurement
