// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/kernels/bf16_rounding.hpp"
#include "recon/nerf/kernels/tile_layers.hpp"

// Layers on AMX tiles; grid and optimiser stay as in AVX-512.
namespace orbitfuse::nerf {
namespace {

/// The processor's tiles, for the time of one kernel call: outside it they are in their initial
/// state, so no other code, thread switch or signal pays for saving them. GCC 12's own intrinsics
/// want the tile's number as a literal and don't tell the compiler that a load reads memory.
class AmxTiles {
 public:
  explicit AmxTiles(const TileConfig& config) {
    __asm__ volatile("ldtilecfg %0" : : "m"(config) : "memory");
  }
  ~AmxTiles() { __asm__ volatile("tilerelease" : : : "memory"); }
  AmxTiles(const AmxTiles&) = delete;
  AmxTiles& operator=(const AmxTiles&) = delete;

  template <int T>
  void zero() {
    __asm__ volatile("tilezero %%tmm%c0" : : "i"(T));
  }
  template <int T>
  void load(const void* base, long row_bytes) {
    __asm__ volatile("tileloadd (%0,%1,1), %%tmm%c2"
                     :
                     : "r"(base), "r"(row_bytes), "i"(T)
                     : "memory");
  }
  template <int T>
  void store(void* base, long row_bytes) {
    __asm__ volatile("tilestored %%tmm%c2, (%0,%1,1)"
                     :
                     : "r"(base), "r"(row_bytes), "i"(T)
                     : "memory");
  }
  template <int Sum, int Left, int Right>
  void multiply_add() {
    __asm__ volatile("tdpbf16ps %%tmm%c2, %%tmm%c1, %%tmm%c0" : : "i"(Sum), "i"(Left), "i"(Right));
  }
};

}  // namespace

const Kernels& kernels_amx() {
  using Layers = TileLayers<AmxTiles, Avx512Rounding>;
  static const Kernels table = [] {
    Kernels k = kernels_avx512bf16();
    k.isa = Isa::amx;
    k.forward = Layers::forward;
    k.backward_input = Layers::backward_input;
    k.backward_weights = Layers::backward_weights;
    return k;
  }();
  return table;
}

}  // namespace orbitfuse::nerf
