// SPDX-License-Identifier: BSD-3-Clause
#include <immintrin.h>

#include "fusion/cnn_lpif/conv_row.hpp"

namespace orbitfuse::fusion::cnn {
namespace {
struct Avx2 {
  using Type = __m256;
  static constexpr int lanes = 8;
  static Type load(const float* p) { return _mm256_loadu_ps(p); }
  static void store(float* p, Type v) { _mm256_storeu_ps(p, v); }
  static Type broadcast(float v) { return _mm256_set1_ps(v); }
  static Type multiply_add(Type a, Type b, Type c) { return _mm256_fmadd_ps(a, b, c); }
  static Type larger(Type a, Type b) { return _mm256_max_ps(a, b); }
};
}  // namespace

void conv_row_avx2(const ConvRow& row) { conv_row<Avx2>(row); }

}  // namespace orbitfuse::fusion::cnn
