// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <immintrin.h>
#include <algorithm>

// glibc's vector mathematics: four at once, off by less than four units in the last place.
extern "C" __m256d _ZGVdN4v_exp(__m256d);
extern "C" __m256d _ZGVdN4v_atan(__m256d);

namespace orbitfuse::metrics {

/// Four samples at any address; arithmetic on them is AVX2's.
using Lanes = double __attribute__((vector_size(32), aligned(8), may_alias));
constexpr int lanes = 4;

inline Lanes exp_of(Lanes x) { return _ZGVdN4v_exp(x); }
inline Lanes atan_of(Lanes x) { return _ZGVdN4v_atan(x); }
inline Lanes sqrt_of(Lanes x) { return _mm256_sqrt_pd(x); }
inline double sum_of(Lanes x) { return (x[0] + x[1]) + (x[2] + x[3]); }

/// act(x, count) for each four of a row's samples; the last may be fewer.
template <class Act>
void for_lanes(int width, const Act& act) {
  for (int x = 0; x < width; x += lanes) act(x, std::min(lanes, width - x));
}
/// The first `count` of four; the others are 0.
inline Lanes load(const double* from, int count) {
  if (count == lanes) return *reinterpret_cast<const Lanes*>(from);
  Lanes some{};
  for (int k = 0; k < count; ++k) some[k] = from[k];
  return some;
}
inline void store(Lanes values, double* to, int count) {
  if (count == lanes)
    *reinterpret_cast<Lanes*>(to) = values;
  else
    for (int k = 0; k < count; ++k) to[k] = values[k];
}

}  // namespace orbitfuse::metrics
