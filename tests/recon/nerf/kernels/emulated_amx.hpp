// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/nerf/kernels/kernels.hpp"

namespace orbitfuse::nerf::test {

/// The layers of kernels_amx() on emulated tiles, with plain rounding: for any processor. The other
/// kernels are those of AVX2.
const Kernels& emulated_amx();

}  // namespace orbitfuse::nerf::test
