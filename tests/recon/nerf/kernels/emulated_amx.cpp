// SPDX-License-Identifier: BSD-3-Clause
#include "tests/recon/nerf/kernels/emulated_amx.hpp"

#include "recon/nerf/kernels/tile_layers.hpp"
#include "tests/recon/nerf/kernels/tile_machine.hpp"

namespace orbitfuse::nerf::test {
namespace {

class EmulatedTiles {
 public:
  explicit EmulatedTiles(const TileConfig& config) { machine_.configure(&config); }
  template <int T>
  void zero() {
    machine_.zero(T);
  }
  template <int T>
  void load(const void* base, long row_bytes) {
    machine_.load(T, base, row_bytes);
  }
  template <int T>
  void store(void* base, long row_bytes) const {
    machine_.store(T, base, row_bytes);
  }
  template <int Sum, int Left, int Right>
  void multiply_add() {
    machine_.multiply_add(Sum, Left, Right);
  }

 private:
  TileMachine machine_;
};

struct PlainRounding {
  static void in_order(const float* in, int count, std::uint16_t* out) {
    for (int i = 0; i < count; ++i) out[i] = bf16_of(in[i]);
  }
  static void pair_rows(const float* in, int rows, int width, std::uint16_t* out) {
    for (int s = 0; s < rows + rows % 2; ++s)
      for (int i = 0; i < width; ++i)
        out[(s / 2 * width + i) * 2 + s % 2] =
            s < rows ? bf16_of(in[s * width + i]) : std::uint16_t{0};
  }
  static void transpose(const float* in, int rows, int width, long stride, std::uint16_t* out) {
    for (int s = 0; s < (rows + 31) / 32 * 32; ++s)
      for (int i = 0; i < width; ++i)
        out[i * stride + s] = s < rows ? bf16_of(in[s * width + i]) : std::uint16_t{0};
  }
};

}  // namespace

const Kernels& emulated_amx() {
  using Layers = TileLayers<EmulatedTiles, PlainRounding>;
  static const Kernels table = [] {
    Kernels k = kernels_avx2();
    k.isa = Isa::amx;
    k.forward = Layers::forward;
    k.backward_input = Layers::backward_input;
    k.backward_weights = Layers::backward_weights;
    return k;
  }();
  return table;
}

}  // namespace orbitfuse::nerf::test
