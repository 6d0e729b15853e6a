// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "core/system/cpu.hpp"

// The inner loops, one table of functions per instruction set. Matrices are row-major; widths (K,
// N) are multiples of 16; rows are samples.
namespace orbitfuse::nerf {

/// One resolution of the hash grid. Cell (x, y, z) has its 8 corners at `resolution + 1` nodes per
/// axis; a level whose nodes fit into the table is stored densely, others are hashed (Müller et
/// al. 2022, eq. 4).
struct GridLevel {
  int resolution = 0;  ///< cells per axis over [0, 1]
  bool dense = false;
  std::uint32_t mask = 0;     ///< table entries - 1 (hashed levels)
  std::uint32_t entries = 0;  ///< in the table
  std::int64_t offset = 0;    ///< first float of this level in the parameter vector
  int features = 4;           ///< 2 or 4
};

/// Four successive numbers of a grid's table with everything that one step reads and writes of
/// them. A step touches a fifth of a level's entries in random order: one cache line each, instead
/// of one in each of four arrays.
struct alignas(64) GridLine {
  float value[4] = {}, first[4] = {}, second[4] = {}, grad[4] = {};
};

/// A dense layer's weights in the layouts the kernels read; refreshed after each optimiser step.
struct LayerView {
  int in = 0, out = 0;
  const float* weights = nullptr;           ///< [in][out]
  const float* transposed = nullptr;        ///< [out][in]
  const std::uint16_t* paired = nullptr;    ///< bf16 [in/2][out][2]
  const std::uint16_t* paired_t = nullptr;  ///< bf16 [out/2][in][2]
};

struct AdamStep {
  float learning_rate = 0, beta1 = 0.9f, beta2 = 0.99f, epsilon = 1e-15f;
  float correction1 = 1, correction2 = 1;  ///< 1 / (1 - beta^t)
  float weight_decay = 0;                  ///< L2, added to the gradient
};

struct Kernels {
  Isa isa;
  /// out[s][0..features) (row stride `stride`) of one level at positions in [0, 1]^3.
  void (*encode)(const GridLevel& level, const std::uint16_t* half_table, const float* position,
                 int count, float* out, int stride);
  /// grad[entry] += weight * dfeatures[s], samples in order. Sets the bits of the lines that it
  /// writes to; `lines` and `touched` are the level's own.
  void (*scatter)(const GridLevel& level, GridLine* lines, std::uint64_t* touched,
                  const float* position, int count, const float* dfeatures);
  /// out = in * weights, then max(0, .) if relu.
  void (*forward)(const LayerView& layer, int rows, const float* in, float* out, bool relu);
  /// din = dout * weights^T, zeroed where activation <= 0 (activation may be null).
  void (*backward_input)(const LayerView& layer, int rows, const float* dout, float* din,
                         const float* activation);
  /// dweights[in][out] += in^T * dout.
  void (*backward_weights)(const LayerView& layer, int rows, const float* in, const float* dout,
                           float* dweights);
  /// Adam (Kingma & Ba 2015) on [0, count), count a multiple of 8; entries whose gradient is
  /// exactly 0 keep their state, as in instant-ngp. Clears the gradient.
  void (*adam)(const AdamStep& step, std::int64_t count, float* parameter, float* first,
               float* second, float* grad);
  /// The same on the lines whose bits are set in `words` words; clears the bits too. Values stay
  /// within +-max_half and are copied to `half`, 4 a line.
  void (*adam_lines)(const AdamStep& step, std::int64_t words, std::uint64_t* touched,
                     GridLine* lines, std::uint16_t* half);
};

/// The kernels for an instruction set; a set this build or machine lacks gives the next lower one.
const Kernels& kernels_for(Isa isa);

const Kernels& kernels_avx2();
const Kernels& kernels_avx512();
const Kernels& kernels_avx512bf16();
const Kernels& kernels_amx();  ///< the layers; the rest is that of AVX-512

inline constexpr float max_half = 60000.0f;  ///< grid parameters are kept within +-this

}  // namespace orbitfuse::nerf
