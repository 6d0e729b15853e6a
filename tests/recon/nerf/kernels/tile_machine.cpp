// SPDX-License-Identifier: BSD-3-Clause
#include "tests/recon/nerf/kernels/tile_machine.hpp"

#include <bit>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace orbitfuse::nerf::test {
namespace {

void require(bool condition, const char* what) {
  if (!condition) throw std::logic_error(what);
}

constexpr std::uint32_t sign = 0x80000000u, exponent = 0x7f800000u;

/// Denormals are 0, as operands and as results.
float flushed(float x) {
  const auto bits = std::bit_cast<std::uint32_t>(x);
  return std::bit_cast<float>(bits & exponent ? bits : bits & sign);
}

float float_of(std::uint16_t bf16) {
  return flushed(std::bit_cast<float>(static_cast<std::uint32_t>(bf16) << 16));
}

}  // namespace

void TileMachine::configure(const void* bytes64) {
  std::uint8_t bytes[64];
  std::memcpy(bytes, bytes64, 64);
  if (bytes[0] == 0) return release();
  require(bytes[0] == 1, "palette");
  require(bytes[1] == 0, "start_row without an interrupted load");
  for (int i = 2; i < 16; ++i) require(bytes[i] == 0, "reserved bytes");
  for (int t = 0; t < 16; ++t) {
    const int row_bytes = bytes[16 + 2 * t] + 256 * bytes[17 + 2 * t], rows = bytes[48 + t];
    require(rows <= 16 && row_bytes <= 64, "a tile has at most 16 rows of 64 bytes");
    require((rows == 0) == (row_bytes == 0), "rows without bytes, or bytes without rows");
    require(t < 8 || rows == 0, "there are 8 tiles");
    if (t < 8) tiles_[static_cast<std::size_t>(t)] = {rows, row_bytes, {}};
  }
  configured_ = true;
}

void TileMachine::release() {
  tiles_.fill({});
  configured_ = false;
}

const TileMachine::Tile& TileMachine::tile(int index) const {
  require(configured_, "tiles are not configured");
  const Tile& t = tiles_.at(static_cast<std::size_t>(index));
  require(t.rows > 0, "tile is not configured");
  return t;
}

TileMachine::Tile& TileMachine::tile(int index) {
  return const_cast<Tile&>(std::as_const(*this).tile(index));
}

void TileMachine::zero(int index) { tile(index).data = {}; }

void TileMachine::load(int index, const void* base, std::int64_t stride) {
  Tile& t = tile(index);
  t.data = {};
  const auto* from = static_cast<const std::uint8_t*>(base);
  for (int r = 0; r < t.rows; ++r)
    std::memcpy(t.data[static_cast<std::size_t>(r)].data(), from + r * stride,
                static_cast<std::size_t>(t.row_bytes));
}

void TileMachine::store(int index, void* base, std::int64_t stride) const {
  const Tile& t = tile(index);
  auto* to = static_cast<std::uint8_t*>(base);
  for (int r = 0; r < t.rows; ++r)
    std::memcpy(to + r * stride, t.data[static_cast<std::size_t>(r)].data(),
                static_cast<std::size_t>(t.row_bytes));
}

void TileMachine::multiply_add(int sum, int left, int right) {
  Tile& c = tile(sum);
  const Tile &a = tile(left), &b = tile(right);
  require(sum != left && sum != right && left != right, "one tile as two operands");
  require(c.row_bytes % 4 == 0 && a.row_bytes % 4 == 0 && b.row_bytes % 4 == 0, "bytes of a row");
  require(c.rows == a.rows && a.row_bytes / 4 == b.rows && b.row_bytes == c.row_bytes,
          "shapes differ");
  float right_even[16][16], right_odd[16][16];
  for (std::size_t k = 0; k < 16; ++k) {
    std::uint16_t row[32];
    std::memcpy(row, b.data[k].data(), 64);
    for (int n = 0; n < 16; ++n) {
      right_even[k][n] = float_of(row[2 * n]);
      right_odd[k][n] = float_of(row[2 * n + 1]);
    }
  }
  for (std::size_t m = 0; m < static_cast<std::size_t>(c.rows); ++m) {
    std::uint16_t row[32];
    std::memcpy(row, a.data[m].data(), 64);
    float even[16] = {}, odd[16] = {}, total[16];
    for (int k = 0; k < a.row_bytes / 4; ++k) {
      const float left_even = float_of(row[2 * k]), left_odd = float_of(row[2 * k + 1]);
      for (int n = 0; n < 16; ++n) {
        even[n] = flushed(std::fma(left_even, right_even[k][n], even[n]));
        odd[n] = flushed(std::fma(left_odd, right_odd[k][n], odd[n]));
      }
    }
    std::memcpy(total, c.data[m].data(), 64);
    for (int n = 0; n < c.row_bytes / 4; ++n)
      total[n] = flushed(flushed(total[n]) + flushed(even[n] + odd[n]));
    c.data[m] = {};
    std::memcpy(c.data[m].data(), total, static_cast<std::size_t>(c.row_bytes));
  }
}

std::uint16_t bf16_of(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  if ((bits & exponent) == 0) return static_cast<std::uint16_t>((bits & sign) >> 16);
  if (std::isnan(value)) return static_cast<std::uint16_t>(bits >> 16 | 0x40u);
  if (std::isinf(value)) return static_cast<std::uint16_t>(bits >> 16);
  return static_cast<std::uint16_t>((bits + 0x7fffu + (bits >> 16 & 1u)) >> 16);
}

}  // namespace orbitfuse::nerf::test
