// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace orbitfuse {

/// Instruction sets a kernel may be dispatched to, in rising order.
enum class Isa { avx2, avx512, avx512bf16, amx };

/// What this processor and kernel can run. ORBITFUSE_ISA=avx2|avx512|avx512bf16|amx in the
/// environment lowers it (never raises it), for benchmarks and tests.
Isa best_isa();
const char* name(Isa isa);
/// False on a processor below the AVX2 baseline; main() then refuses to start.
bool has_baseline();
/// "AMD EPYC ..., 2 threads", for benchmark headers.
std::string cpu_description();

}  // namespace orbitfuse
