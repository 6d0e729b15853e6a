// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/kernels/kernels.hpp"

namespace orbitfuse::nerf {

const Kernels& kernels_for(Isa isa) {
  const Isa usable = isa < best_isa() ? isa : best_isa();
  switch (usable) {
    case Isa::amx:
      return kernels_amx();
    case Isa::avx512bf16:
      return kernels_avx512bf16();
    case Isa::avx512:
      return kernels_avx512();
    case Isa::avx2:
      break;
  }
  return kernels_avx2();
}

}  // namespace orbitfuse::nerf
