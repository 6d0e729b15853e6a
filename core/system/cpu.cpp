// SPDX-License-Identifier: BSD-3-Clause
#include "core/system/cpu.hpp"
#include "core/system/isa_wish.hpp"

#include <cpuid.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <thread>

namespace orbitfuse {
namespace {

/// arch_prctl(ARCH_REQ_XCOMP_PERM, XFEATURE_XTILEDATA), for all threads of the process; see the
/// Linux documentation's arch/x86/xstate.
bool request_tiles() {
  constexpr int arch_req_xcomp_perm = 0x1023;
  constexpr int xfeature_xtiledata = 18;
  return syscall(SYS_arch_prctl, arch_req_xcomp_perm, xfeature_xtiledata) == 0;
}

CpuFeatures features_here() {
  __builtin_cpu_init();
  CpuFeatures f;
  f.avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
             __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq");
  f.avx512_bf16 = __builtin_cpu_supports("avx512bf16");
  unsigned eax = 0, ebx = 0, ecx = 0, edx = 0;
  if (__get_cpuid_count(7, 0, &eax, &ebx, &ecx, &edx)) {
    f.amx_bf16 = edx & (1u << 22);
    f.amx_tile = edx & (1u << 24);
  }
  constexpr unsigned osxsave = 1u << 27, tile_bits = 3u << 17;
  if (__get_cpuid(1, &eax, &ebx, &ecx, &edx) && (ecx & osxsave)) {
    unsigned low = 0, high = 0;
    __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    f.tile_state = (low & tile_bits) == tile_bits;
  }
  return f;
}

}  // namespace

Isa best_isa() {
  static const Isa isa = [] {
    const char* wanted = std::getenv("ORBITFUSE_ISA");
    return best_isa(features_here(), wanted ? wanted : "", request_tiles);
  }();
  return isa;
}

Status check_isa_wish() {
  const char* wanted = std::getenv("ORBITFUSE_ISA");
  if (!wanted || !*wanted) return {};
  for (Isa known : {Isa::avx2, Isa::avx512, Isa::avx512bf16, Isa::amx})
    if (std::string_view(wanted) == name(known)) return {};
  return fail(ErrorKind::usage, "ORBITFUSE_ISA", wanted,
              "write avx2, avx512, avx512bf16 or amx, or unset it");
}

Isa best_isa(const CpuFeatures& features, std::string_view wanted, bool (*permit_tiles)()) {
  Isa isa = Isa::avx2;
  if (features.avx512) isa = features.avx512_bf16 ? Isa::avx512bf16 : Isa::avx512;
  if (isa == Isa::avx512bf16 && features.amx_tile && features.amx_bf16 && features.tile_state)
    isa = Isa::amx;
  for (Isa candidate : {Isa::avx2, Isa::avx512, Isa::avx512bf16, Isa::amx})
    if (wanted == name(candidate)) isa = std::min(isa, candidate);
  return isa == Isa::amx && !permit_tiles() ? Isa::avx512bf16 : isa;
}

const char* name(Isa isa) {
  constexpr std::array names{"avx2", "avx512", "avx512bf16", "amx"};
  return names[static_cast<std::size_t>(isa)];
}

bool has_baseline() {
  __builtin_cpu_init();
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
}

std::string cpu_description() {
  std::ifstream cpuinfo("/proc/cpuinfo");
  std::string line, model = "unknown CPU";
  while (std::getline(cpuinfo, line)) {
    if (line.starts_with("model name")) {
      model = line.substr(line.find(':') + 2);
      break;
    }
  }
  return model + ", " + std::to_string(std::thread::hardware_concurrency()) + " threads, " +
         name(best_isa());
}

}  // namespace orbitfuse
