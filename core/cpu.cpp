// SPDX-License-Identifier: BSD-3-Clause
#include "core/cpu.hpp"

#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <string_view>
#include <thread>

namespace orbitfuse {
namespace {

/// Linux grants the AMX tile registers only on request (arch_prctl ARCH_REQ_XCOMP_PERM, XTILEDATA).
bool request_amx() {
  constexpr int arch_req_xcomp_perm = 0x1023;
  constexpr int xfeature_xtiledata = 18;
  unsigned eax = 7, ebx = 0, ecx = 0, edx = 0;
  __asm__ volatile("cpuid" : "+a"(eax), "=b"(ebx), "+c"(ecx), "=d"(edx));
  const bool amx_bf16 = edx & (1u << 22), amx_tile = edx & (1u << 24);
  return amx_bf16 && amx_tile && syscall(SYS_arch_prctl, arch_req_xcomp_perm, xfeature_xtiledata) == 0;
}

Isa detect() {
  __builtin_cpu_init();
  Isa isa = Isa::avx2;
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq")) {
    isa = Isa::avx512;
    if (__builtin_cpu_supports("avx512bf16")) isa = request_amx() ? Isa::amx : Isa::avx512bf16;
  }
  if (const char* wanted = std::getenv("ORBITFUSE_ISA")) {
    for (Isa candidate : {Isa::avx2, Isa::avx512, Isa::avx512bf16, Isa::amx}) {
      if (std::string_view(wanted) == name(candidate)) isa = std::min(isa, candidate);
    }
  }
  return isa;
}

}  // namespace

Isa best_isa() {
  static const Isa isa = detect();
  return isa;
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
