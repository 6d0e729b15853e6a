// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace orbitfuse::fusion::cnn {

/// Rows handed to conv_row are readable and writable up to the next multiple of this, and taps this
/// much beyond.
inline constexpr int row_step = 32;

/// One output row of every channel of a convolution:
///   out[c][x] = max(floor, bias[c] + sum_k weights[c][k] * taps[k][x]), x in [0, wide)
/// taps: the input rows, shifted; out: channels `out_stride` floats apart. Sums run over k in order
/// with fused multiply-add, so every instruction set gives the same bits.
struct ConvRow {
  const float* const* taps;
  int tap_count;
  const float* weights;
  const float* bias;
  int channels;
  float floor;  ///< 0: ReLU; minus infinity: none
  float* out;
  int out_stride;
  int wide;
};

void conv_row_avx2(const ConvRow& row);
void conv_row_avx512(const ConvRow& row);

/// `Vector` has load, store, broadcast, multiply_add, larger and lanes. `group` channels times
/// `vectors` columns of accumulators stay in registers.
template <class Vector, int group, int vectors>
inline void conv_group(const ConvRow& r, int c, int x) {
  typename Vector::Type sum[group][vectors];
  for (int i = 0; i < group; ++i)
    for (int v = 0; v < vectors; ++v) sum[i][v] = Vector::broadcast(r.bias[c + i]);
  const float* w = r.weights + c * r.tap_count;
  for (int k = 0; k < r.tap_count; ++k) {
    const float* in = r.taps[k] + x;
    for (int i = 0; i < group; ++i) {
      const auto weight = Vector::broadcast(w[i * r.tap_count + k]);
      for (int v = 0; v < vectors; ++v)
        sum[i][v] = Vector::multiply_add(weight, Vector::load(in + v * Vector::lanes), sum[i][v]);
    }
  }
  for (int i = 0; i < group; ++i)
    for (int v = 0; v < vectors; ++v)
      Vector::store(r.out + (c + i) * r.out_stride + x + v * Vector::lanes,
                    Vector::larger(sum[i][v], Vector::broadcast(r.floor)));
}

template <class Vector>
inline void conv_row(const ConvRow& r) {
  constexpr int group = 4, vectors = 2;
  for (int x = 0; x < r.wide; x += vectors * Vector::lanes) {
    int c = 0;
    for (; c + group <= r.channels; c += group) conv_group<Vector, group, vectors>(r, c, x);
    for (; c < r.channels; ++c) conv_group<Vector, 1, vectors>(r, c, x);
  }
}

}  // namespace orbitfuse::fusion::cnn
