// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/pca_msif/fast_explicit_diffusion.hpp"

#include <cmath>
#include <numbers>

namespace orbitfuse::fusion {
namespace {

constexpr int most_steps = 20;

bool is_prime(int n) {
  for (int i = 2; i * i <= n; ++i)
    if (n % i == 0) return false;
  return true;
}

/// Indices 0..n-1, spread: multiples of kappa modulo the next prime above n.
std::vector<int> spread_order(int n) {
  int prime = n + 1;
  while (!is_prime(prime)) ++prime;
  const int kappa = n / 4 + 1;
  std::vector<int> order;
  for (int k = 1; k < prime; ++k)
    if (const int index = k * kappa % prime - 1; index < n) order.push_back(index);
  return order;
}

}  // namespace

double longest_cycle(double stable_step) { return stable_step * most_steps * (most_steps + 1) / 3; }

std::vector<double> fast_explicit_steps(double time, double stable_step) {
  int n = 1;
  while (stable_step * n * (n + 1) / 3 < time) ++n;
  const double scale = time / (stable_step * n * (n + 1) / 3);
  std::vector<double> steps;
  for (const int i : spread_order(n)) {
    const double c = std::cos(std::numbers::pi * (2 * i + 1) / (4 * n + 2));
    steps.push_back(scale * stable_step / (2 * c * c));
  }
  return steps;
}

}  // namespace orbitfuse::fusion
