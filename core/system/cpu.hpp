// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

namespace orbitfuse {

/// Instruction sets a kernel may be dispatched to, in rising order.
enum class Isa { avx2, avx512, avx512bf16, amx };

/// What this processor and kernel can run. ORBITFUSE_ISA=avx2|avx512|avx512bf16|amx in the
/// environment lowers it (never raises it), for benchmarks and tests.
Isa best_isa();

/// What a processor and its kernel offer beyond the baseline.
struct CpuFeatures {
  bool avx512 = false;  ///< F, BW, VL and DQ
  bool avx512_bf16 = false;
  bool amx_tile = false, amx_bf16 = false;  ///< CPUID leaf 7
  bool tile_state = false;                  ///< the kernel saves tiles (XCR0 bits 17 and 18)
};
/// best_isa() of such a machine; `wanted` as ORBITFUSE_ISA, `permit_tiles` asks the kernel for the
/// tile registers (Linux hands them out on request only) and is called only where they would be
/// used.
Isa best_isa(const CpuFeatures& features, std::string_view wanted, bool (*permit_tiles)());
const char* name(Isa isa);
/// False on a processor below the AVX2 baseline; main() then refuses to start.
bool has_baseline();
/// "AMD EPYC ..., 2 threads", for benchmark headers.
std::string cpu_description();

}  // namespace orbitfuse
