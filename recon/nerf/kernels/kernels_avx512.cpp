// SPDX-License-Identifier: BSD-3-Clause
#define ORBITFUSE_LANES 16
#include "recon/nerf/kernels/kernels_impl.hpp"

namespace orbitfuse::nerf {

const Kernels& kernels_avx512() {
  static constexpr Kernels table{Isa::avx512, encode_grid,        scatter_grid,
                                 forward_f32, backward_input_f32, backward_weights_f32,
                                 adam_update, adam_lines};
  return table;
}

}  // namespace orbitfuse::nerf
