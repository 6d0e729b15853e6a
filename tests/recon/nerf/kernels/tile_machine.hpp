// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

namespace orbitfuse::nerf::test {

/// The AMX tiles as the manual has them (Intel SDM volume 1, "Programming with Intel AMX"; volume
/// 2, LDTILECFG to TILEZERO). What a processor would refuse throws std::logic_error: configurations
/// out of range (#GP), shapes that don't fit each other and tiles that aren't configured (#UD).
class TileMachine {
 public:
  void configure(const void* bytes64);
  void release();
  bool configured() const { return configured_; }
  void zero(int tile);
  void load(int tile, const void* base, std::int64_t stride);
  void store(int tile, void* base, std::int64_t stride) const;
  /// TDPBF16PS: sum += left * right.
  void multiply_add(int sum, int left, int right);

 private:
  struct Tile {
    int rows = 0, row_bytes = 0;
    alignas(64) std::array<std::array<std::uint8_t, 64>, 16> data{};
  };
  const Tile& tile(int index) const;
  Tile& tile(int index);

  std::array<Tile, 8> tiles_;
  bool configured_ = false;
};

/// VCVTNEPS2BF16: to nearest even, denormals to 0, NaN made quiet.
std::uint16_t bf16_of(float value);

}  // namespace orbitfuse::nerf::test
