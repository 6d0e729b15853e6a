// SPDX-License-Identifier: BSD-3-Clause
#include <immintrin.h>

#include "fusion/cnn_lpif/conv_row.hpp"

namespace orbitfuse::fusion::cnn {
namespace {
struct Avx512 {
  using Type = __m512;
  static constexpr int lanes = 16;
  static Type load(const float* p) { return _mm512_loadu_ps(p); }
  static void store(float* p, Type v) { _mm512_storeu_ps(p, v); }
  static Type broadcast(float v) { return _mm512_set1_ps(v); }
  static Type multiply_add(Type a, Type b, Type c) { return _mm512_fmadd_ps(a, b, c); }
  // The unmasked intrinsic trips -Wuninitialized in g++ 12 (GCC bug 105593).
  static Type larger(Type a, Type b) { return _mm512_maskz_max_ps(0xffff, a, b); }
};
}  // namespace

void conv_row_avx512(const ConvRow& row) { conv_row<Avx512>(row); }

}  // namespace orbitfuse::fusion::cnn
