// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/nerf/device/launch.hpp"

// Dense layers on a device (as Mlp): widths are multiples of 16.
namespace orbitfuse::nerf::ORBITFUSE_ENGINE {

constexpr int outputs_per_thread = 16;
enum class Epilogue { store, relu, mask };

/// out[o] = sum_i in[i] * weights[i][o]: a thread a sample and 16 outputs. Backward to the inputs,
/// it is given the transposed weights and masks by the activations.
struct ApplyLayer {
  int inputs, outputs;
  const float* weights;  ///< [inputs][outputs]
  Rows in, out;
  SampleCount samples;
  Epilogue epilogue;
  Rows activation;  ///< Epilogue::mask: zero where it isn't positive

  static int threads(int outputs, int bound) { return outputs / outputs_per_thread * bound; }

  ORBITFUSE_HOST_DEVICE void operator()(int i) const {
    const int first = i / samples.bound * outputs_per_thread, s = i % samples.bound;
    if (s >= *samples.counted) return;
    float sum[outputs_per_thread] = {};
    const float* w = weights + first;
    const float* x = in.at + s;
    for (int k = 0; k < inputs; ++k, w += outputs, x += in.stride) {
      const float value = *x;
      for (int quarter = 0; quarter < outputs_per_thread / 4; ++quarter) {
        const Four four = load_four(w + 4 * quarter);
        for (int j = 0; j < 4; ++j) sum[4 * quarter + j] += value * four.v[j];
      }
    }
    for (int j = 0; j < outputs_per_thread; ++j) {
      float value = sum[j];
      if (epilogue == Epilogue::relu) value = value > 0 ? value : 0.0f;
      if (epilogue == Epilogue::mask) value = activation(first + j, s) > 0 ? value : 0.0f;
      out(first + j, s) = value;
    }
  }
};

constexpr int weight_chunks = 128;  ///< of the samples; their sums are added in this order

/// Sums of in[i] * dout[o] over one chunk of samples: a thread 4 x 4 weights.
struct WeightGradient {
  int inputs, outputs;
  Rows in, dout;
  const int* counted;
  float* partial;  ///< [weight_chunks][inputs][outputs]

  static int threads(int inputs, int outputs) {
    return weight_chunks * (inputs / 4) * (outputs / 4);
  }

  ORBITFUSE_HOST_DEVICE void operator()(int index) const {
    const int across = outputs / 4, tiles = inputs / 4 * across;
    const int chunk = index / tiles, i = index % tiles / across * 4, o = index % across * 4;
    const int per_chunk = ((*counted + weight_chunks - 1) / weight_chunks + 3) / 4 * 4;
    const int begin = chunk * per_chunk;
    const int end = begin + per_chunk < *counted ? begin + per_chunk : *counted;
    float sum[4][4] = {};
    int s = begin;
    for (; s + 4 <= end; s += 4) {
      Four x[4], d[4];
      for (int k = 0; k < 4; ++k) {
        x[k] = load_four(in.row(i + k) + s);
        d[k] = load_four(dout.row(o + k) + s);
      }
      for (int u = 0; u < 4; ++u)
        for (int a = 0; a < 4; ++a)
          for (int b = 0; b < 4; ++b) sum[a][b] += x[a].v[u] * d[b].v[u];
    }
    for (; s < end; ++s)
      for (int a = 0; a < 4; ++a)
        for (int b = 0; b < 4; ++b) sum[a][b] += in(i + a, s) * dout(o + b, s);
    float* to = partial + static_cast<long>(chunk) * inputs * outputs;
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) to[(i + a) * outputs + o + b] = sum[a][b];
  }
};

struct SumChunks {
  int count;             ///< weights of the layer
  const float* partial;  ///< [weight_chunks][count]
  float* gradient;
  int* finite;

  ORBITFUSE_HOST_DEVICE void operator()(int i) const {
    float sum = 0;
    for (int chunk = 0; chunk < weight_chunks; ++chunk)
      sum += partial[static_cast<long>(chunk) * count + i];
    gradient[i] = sum;
    if (!is_finite(sum)) *finite = 0;
  }
};

}  // namespace orbitfuse::nerf::ORBITFUSE_ENGINE
