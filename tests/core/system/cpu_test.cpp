// SPDX-License-Identifier: BSD-3-Clause
#include "core/system/cpu.hpp"

#include <gtest/gtest.h>

namespace orbitfuse {
namespace {

int asked = 0;
bool granted() { return ++asked > 0; }
bool refused() { return ++asked < 0; }

constexpr CpuFeatures everything{
    .avx512 = true, .avx512_bf16 = true, .amx_tile = true, .amx_bf16 = true, .tile_state = true};

CpuFeatures without(bool CpuFeatures::*feature) {
  CpuFeatures f = everything;
  f.*feature = false;
  return f;
}

TEST(Cpu, TilesAreOfferedOnlyIfProcessorAndKernelAgree) {
  EXPECT_EQ(best_isa(everything, "", granted), Isa::amx);
  EXPECT_EQ(best_isa(everything, "", refused), Isa::avx512bf16);
  for (const auto missing :
       {&CpuFeatures::amx_tile, &CpuFeatures::amx_bf16, &CpuFeatures::tile_state}) {
    asked = 0;
    EXPECT_EQ(best_isa(without(missing), "", granted), Isa::avx512bf16);
    EXPECT_EQ(asked, 0) << "nothing would use them";
  }
  // The kernels around the tiles are those of AVX-512 with bf16.
  EXPECT_EQ(best_isa(without(&CpuFeatures::avx512_bf16), "", granted), Isa::avx512);
  EXPECT_EQ(best_isa(without(&CpuFeatures::avx512), "", granted), Isa::avx2);
  EXPECT_EQ(best_isa({}, "", granted), Isa::avx2);
}

TEST(Cpu, TheEnvironmentLowersAndNeverRaises) {
  for (const Isa wanted : {Isa::avx2, Isa::avx512, Isa::avx512bf16, Isa::amx}) {
    asked = 0;
    EXPECT_EQ(best_isa(everything, name(wanted), granted), wanted);
    EXPECT_EQ(asked, wanted == Isa::amx) << "permission is asked for only by those who use tiles";
    EXPECT_EQ(best_isa({.avx512 = true}, name(wanted), granted), std::min(wanted, Isa::avx512));
  }
  EXPECT_EQ(best_isa(everything, "avx10", granted), Isa::amx) << "unknown names change nothing";
}

TEST(Cpu, TheDescriptionNamesWhatIsUsed) {
  EXPECT_NE(cpu_description().find(name(best_isa())), std::string::npos);
}

}  // namespace
}  // namespace orbitfuse
