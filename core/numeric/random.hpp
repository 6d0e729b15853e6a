// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "core/host_device.hpp"

namespace orbitfuse {

/// SplitMix64 (Steele, Lea, Flood, OOPSLA 2014): the state of a stream goes up by the step.
inline constexpr std::uint64_t split_mix_step = 0x9E3779B97F4A7C15ull;
ORBITFUSE_HOST_DEVICE inline std::uint64_t split_mix(std::uint64_t state) {
  std::uint64_t x = state + split_mix_step;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
  return x ^ (x >> 31);
}

/// Counter-based random numbers: the value depends on the key alone, so
/// draws are the same for any thread count and after a resume.
ORBITFUSE_HOST_DEVICE inline std::uint64_t random_bits(std::uint64_t seed, std::uint64_t stream,
                                                       std::uint64_t counter) {
  const std::uint64_t key = seed * split_mix_step ^ stream * 0xD1B54A32D192ED03ull;
  std::uint64_t x = split_mix(key + counter * 0xBF58476D1CE4E5B9ull);
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  return x ^ (x >> 27);
}

/// Uniform in [0, 1).
ORBITFUSE_HOST_DEVICE inline float uniform01(std::uint64_t bits) {
  return static_cast<float>(bits >> 40) * 0x1p-24f;
}
ORBITFUSE_HOST_DEVICE inline float random_uniform(std::uint64_t seed, std::uint64_t stream,
                                                  std::uint64_t counter) {
  return uniform01(random_bits(seed, stream, counter));
}

/// The n-th of numbers that fill [0, 2^64) evenly, whichever stretch of n is looked at: multiples
/// of an irrational share (Weyl 1916). Those of two shares lie evenly as pairs, too.
inline constexpr std::uint64_t golden_share = split_mix_step;         ///< 2^64 (sqrt 5 - 1) / 2
inline constexpr std::uint64_t silver_share = 0x6A09E667F3BCC909ull;  ///< 2^64 (sqrt 2 - 1)
ORBITFUSE_HOST_DEVICE inline std::uint64_t even_bits(std::uint64_t start, std::uint64_t share,
                                                     std::uint64_t n) {
  return start + n * share;
}

}  // namespace orbitfuse
