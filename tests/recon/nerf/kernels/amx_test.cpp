// SPDX-License-Identifier: BSD-3-Clause
// The layers on tiles, on processors that have none: the manual's semantics in plain C++, and the
// compiled instructions executed one by one by the same. Processors that have them also run
// KernelsTest.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "core/numeric/random.hpp"
#include "recon/nerf/field/network.hpp"
#include "recon/nerf/kernels/tile_layers.hpp"
#include "tests/recon/nerf/kernels/emulated_amx.hpp"
#include "tests/recon/nerf/kernels/tile_machine.hpp"
#include "tests/recon/nerf/kernels/tile_trap.hpp"

namespace orbitfuse::nerf {
namespace {

using test::bf16_of;
using test::emulated_amx;
using test::TileMachine;

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float quiet_nan = std::numeric_limits<float>::quiet_NaN();

std::vector<float> noise(std::size_t count, std::uint64_t seed) {
  std::vector<float> out(count);
  for (std::size_t i = 0; i < count; ++i) out[i] = 2 * random_uniform(seed, 99, i) - 1;
  return out;
}

// ---- the machine ---------------------------------------------------------------------------

TileConfig small_config(int pairs) {
  TileConfig config;
  config.rows[0] = config.rows[1] = 1;
  config.row_bytes[0] = config.row_bytes[2] = 4;
  config.row_bytes[1] = static_cast<std::uint16_t>(4 * pairs);
  config.rows[2] = static_cast<std::uint8_t>(pairs);
  return config;
}

/// sum + left * right for one row and one column of pairs.
float dot(const std::vector<float>& left, const std::vector<float>& right, float sum) {
  std::vector<std::uint16_t> a, b;
  for (const float x : left) a.push_back(bf16_of(x));
  for (const float x : right) b.push_back(bf16_of(x));
  TileMachine machine;
  const TileConfig config = small_config(static_cast<int>(left.size() / 2));
  machine.configure(&config);
  machine.load(0, &sum, 64);
  machine.load(1, a.data(), 64);
  machine.load(2, b.data(), 4);
  machine.multiply_add(0, 1, 2);
  machine.store(0, &sum, 64);
  return sum;
}

TEST(TileMachine, SumsAsTheManualSays) {
  EXPECT_EQ(dot({2, 3}, {5, 7}, 100), 131);
  // Even and odd halves are summed apart, then together, then to the sum: with 2^24 + 1 = 2^24 in
  // fp32, the order decides. ((2^24 + 1) + (1 + 0)) ...
  const float big = 16777216;
  EXPECT_EQ(dot({big, 0, 1, 0}, {1, 0, 1, 0}, 0), big);      // even: 2^24 + 1, to even
  EXPECT_EQ(dot({big, 1, 0, 1}, {1, 1, 0, 1}, 0), big + 2);  // odd: 1 + 1 first
  EXPECT_EQ(dot({1, 0, 1, 0}, {1, 0, 1, 0}, big), big + 2);  // the sum comes last
  EXPECT_EQ(dot({-big, 1, 0, 0}, {1, 1, 0, 0}, big), 1);     // exact: -2^24 + 1 fits
  EXPECT_EQ(dot({3, 0}, {1, 0}, big), big + 4);              // 2^24 + 3, to even
}

TEST(TileMachine, DenormalsAreZeroAndNansAreNot) {
  const float smallest = std::numeric_limits<float>::min();
  EXPECT_EQ(dot({0, 0}, {0, 0}, smallest / 2), 0) << "a denormal sum";
  EXPECT_EQ(dot({smallest, 0}, {0.5f, 0}, 0), 0) << "a denormal product";
  EXPECT_EQ(dot({smallest, 0}, {0.5f, 0}, smallest), smallest);
  EXPECT_EQ(bf16_of(smallest / 2), 0);
  EXPECT_EQ(bf16_of(-smallest / 2), 0x8000);
  EXPECT_TRUE(std::isnan(dot({quiet_nan, 0}, {0, 0}, 0)));
  EXPECT_TRUE(std::isnan(dot({infinity, 0}, {0, 0}, 0)));
  EXPECT_EQ(dot({infinity, 0}, {-2, 0}, 5), -infinity);
  EXPECT_TRUE(std::isnan(dot({infinity, infinity}, {1, -1}, 0)));
}

TEST(TileMachine, RoundsToNearestEven) {
  const auto rounded = [](std::uint32_t bits) { return bf16_of(std::bit_cast<float>(bits)); };
  EXPECT_EQ(rounded(0x3f808000u), 0x3f80) << "a tie, down to even";
  EXPECT_EQ(rounded(0x3f818000u), 0x3f82) << "a tie, up to even";
  EXPECT_EQ(rounded(0x3f808001u), 0x3f81);
  EXPECT_EQ(rounded(0x7f7fffffu), 0x7f80) << "past the largest is infinite";
  EXPECT_EQ(rounded(0x7f800001u), 0x7fc0) << "NaN stays one";
}

TEST(TileMachine, RefusesWhatAProcessorRefuses) {
  const auto configure = [](auto change) {
    TileConfig config = small_config(2);
    change(config);
    TileMachine().configure(&config);
  };
  EXPECT_NO_THROW(configure([](TileConfig&) {}));
  EXPECT_THROW(configure([](TileConfig& c) { c.rows[3] = 17, c.row_bytes[3] = 4; }),
               std::logic_error);
  EXPECT_THROW(configure([](TileConfig& c) { c.rows[3] = 1, c.row_bytes[3] = 65; }),
               std::logic_error);
  EXPECT_THROW(configure([](TileConfig& c) { c.rows[3] = 1; }), std::logic_error);
  EXPECT_THROW(configure([](TileConfig& c) { c.rows[8] = 1, c.row_bytes[8] = 4; }),
               std::logic_error);
  EXPECT_THROW(configure([](TileConfig& c) { c.palette = 2; }), std::logic_error);
  EXPECT_THROW(configure([](TileConfig& c) { c.reserved[3] = 1; }), std::logic_error);
  TileMachine machine;
  EXPECT_THROW(machine.zero(0), std::logic_error);
  const TileConfig config = small_config(2);
  machine.configure(&config);
  EXPECT_THROW(machine.zero(5), std::logic_error);
  EXPECT_THROW(machine.multiply_add(0, 2, 1), std::logic_error) << "operands the wrong way round";
  EXPECT_THROW(machine.multiply_add(0, 1, 1), std::logic_error);
  machine.multiply_add(0, 1, 2);
  machine.release();
  EXPECT_THROW(machine.multiply_add(0, 1, 2), std::logic_error);
}

// ---- the layers ----------------------------------------------------------------------------

/// One layer's results. Behind the last row lies what nobody may touch.
struct Results {
  static constexpr float guard = 12345;
  std::vector<float> out, din, dweights;
};

struct Case {
  Mlp mlp;
  int rows, in_width, out_width;
  std::vector<float> in, dout;

  Case(int width_in, int width_out, int row_count)
      : rows(row_count), in_width(width_in), out_width(width_out) {
    mlp.create({width_in, width_out}, static_cast<std::uint64_t>(4 + width_in));
    in = noise(static_cast<std::size_t>(rows * width_in), 21);
    dout = noise(static_cast<std::size_t>(rows * width_out), 22);
  }

  Results run(const Kernels& kernels, bool relu) const {
    Results r;
    r.out.assign(dout.size() + 1, Results::guard);
    r.din.assign(in.size() + 1, Results::guard);
    r.dweights.assign(mlp.weights.size() + 1, 0.25f);
    r.dweights.back() = Results::guard;
    kernels.forward(mlp.view(0), rows, in.data(), r.out.data(), relu);
    kernels.backward_input(mlp.view(0), rows, dout.data(), r.din.data(),
                           relu ? in.data() : nullptr);
    kernels.backward_weights(mlp.view(0), rows, in.data(), dout.data(), r.dweights.data());
    for (const auto* v : {&r.out, &r.din, &r.dweights}) EXPECT_EQ(v->back(), Results::guard);
    return r;
  }
};

/// A sum of products in double, and that of their magnitudes, to which rounding is relative.
struct Sum {
  double value = 0, magnitude = 0;
  void add(double a, double b) {
    value += a * b;
    magnitude += std::abs(a * b);
  }
};

/// out, din and dweights of a case in double.
struct Reference {
  std::vector<Sum> out, din, dweights;

  explicit Reference(const Case& c)
      : out(c.dout.size()), din(c.in.size()), dweights(c.mlp.weights.size()) {
    const std::vector<float>& w = c.mlp.weights.value;
    const auto inputs = static_cast<std::size_t>(c.in_width),
               outputs = static_cast<std::size_t>(c.out_width);
    for (std::size_t r = 0; r < static_cast<std::size_t>(c.rows); ++r)
      for (std::size_t i = 0; i < inputs; ++i)
        for (std::size_t o = 0; o < outputs; ++o) {
          const double x = c.in[r * inputs + i], d = c.dout[r * outputs + o],
                       weight = w[i * outputs + o];
          out[r * outputs + o].add(x, weight);
          din[r * inputs + i].add(d, weight);
          dweights[i * outputs + o].add(x, d);
        }
  }
};

struct Widths {
  int in, out;
};
/// Every layer of the presets (ours 32-64-16, colour 32-64-16 and thermal 32-32-16; published
/// 32-64-16, 64-128-16, 32-64-64-16, 32-128-128-16 and 32-32-32-16; proposals 16-16-16), the
/// widest, and odd multiples of 16.
constexpr Widths all_widths[] = {{32, 64}, {64, 16},  {64, 64},   {16, 32},  {32, 16},
                                 {32, 32}, {64, 128}, {128, 16},  {32, 128}, {128, 128},
                                 {16, 16}, {16, 64},  {256, 256}, {48, 80},  {80, 48}};

std::vector<int> row_counts(Widths w) {
  return w.in * w.out > 128 * 128 ? std::vector<int>{33}
                                  : std::vector<int>{1, 15, 16, 17, 31, 32, 33, 127, 129, 300};
}

TEST(AmxLayers, FollowDoubleWithinTheRoundingOfTheirOperands) {
  for (const Widths w : all_widths)
    for (const int rows : row_counts(w))
      for (const bool relu : {false, true}) {
        const Case c(w.in, w.out, rows);
        const Results r = c.run(emulated_amx(), relu);
        const Reference exact(c);
        // Both operands are rounded to 8 significant bits, by up to 2^-8 each; 1 % more for the
        // sums.
        constexpr double tolerance = 1.01 / 128;
        for (std::size_t k = 0; k < exact.out.size(); ++k) {
          const double value = relu ? std::max(0.0, exact.out[k].value) : exact.out[k].value;
          ASSERT_NEAR(r.out[k], value, tolerance * exact.out[k].magnitude)
              << w.in << "-" << w.out << " x " << rows;
        }
        for (std::size_t k = 0; k < exact.din.size(); ++k) {
          const double value = relu && c.in[k] <= 0 ? 0.0 : exact.din[k].value;
          ASSERT_NEAR(r.din[k], value, tolerance * exact.din[k].magnitude)
              << w.in << "-" << w.out << " x " << rows;
        }
        for (std::size_t k = 0; k < exact.dweights.size(); ++k)
          ASSERT_NEAR(r.dweights[k], 0.25 + exact.dweights[k].value,
                      tolerance * exact.dweights[k].magnitude + 1e-6)
              << w.in << "-" << w.out << " x " << rows;
      }
}

TEST(AmxLayers, DifferFromAvx512OnlyInTheOrderOfTheirSums) {
  if (best_isa() < Isa::avx512bf16)
    GTEST_SKIP() << "this processor has no AVX-512 with bf16 to compare with";
  for (const Widths w : all_widths)
    for (const int rows : row_counts(w)) {
      const Case c(w.in, w.out, rows);
      const Results amx = c.run(emulated_amx(), true), avx512 = c.run(kernels_avx512bf16(), true);
      const Reference exact(c);
      const auto near = [](const std::vector<float>& a, const std::vector<float>& b,
                           const std::vector<Sum>& sums, int terms) {
        for (std::size_t k = 0; k < sums.size(); ++k)
          ASSERT_NEAR(a[k], b[k], terms * 0x1p-23 * (0.25 + sums[k].magnitude));
      };
      near(amx.out, avx512.out, exact.out, w.in);
      near(amx.din, avx512.din, exact.din, w.out);
      near(amx.dweights, avx512.dweights, exact.dweights, rows);
    }
}

TEST(AmxLayers, WhatIsNotFiniteStaysInItsRowAndColumn) {
  for (const float bad : {quiet_nan, infinity, -infinity}) {
    const int rows = 45, hit = 37, column = 5;
    const Case clean(32, 64, rows);
    Case c = clean;
    c.in[static_cast<std::size_t>(hit * 32 + column)] = bad;
    const Results without = clean.run(emulated_amx(), false), with = c.run(emulated_amx(), false);
    const Results other = c.run(kernels_for(Isa::avx512bf16), false);
    for (std::size_t k = 0; k < c.dout.size(); ++k) {
      EXPECT_EQ(std::isfinite(with.out[k]), k / 64 != hit);
      EXPECT_EQ(std::isnan(with.out[k]), std::isnan(other.out[k]));
      if (k / 64 != hit) {
        EXPECT_EQ(with.out[k], without.out[k]);
      }
    }
    for (std::size_t k = 0; k < c.mlp.weights.size(); ++k) {
      EXPECT_EQ(std::isfinite(with.dweights[k]), k / 64 != column);
      if (k / 64 != column) {
        EXPECT_EQ(with.dweights[k], without.dweights[k]);
      }
    }
    // A rectified NaN is 0 in every kernel.
    const Results rectified = c.run(emulated_amx(), true),
                  other_rectified = c.run(kernels_for(Isa::avx512bf16), true);
    for (std::size_t k = hit * 64; k < (hit + 1) * 64; ++k)
      EXPECT_EQ(rectified.out[k], other_rectified.out[k]);
  }
}

TEST(AmxLayers, OfZerosAndOfNothing) {
  Case c(32, 64, 50);
  c.in.assign(c.in.size(), 0.0f);
  c.dout.assign(c.dout.size(), -0.0f);
  const Results r = c.run(emulated_amx(), false);
  for (std::size_t k = 0; k + 1 < r.out.size(); ++k) EXPECT_EQ(r.out[k], 0);
  for (std::size_t k = 0; k + 1 < r.dweights.size(); ++k) EXPECT_EQ(r.dweights[k], 0.25f);
  c.rows = 0;
  const Results nothing = c.run(emulated_amx(), false);
  EXPECT_EQ(nothing.out.front(), Results::guard);
  EXPECT_EQ(nothing.dweights.front(), 0.25f);
}

/// A whole perceptron there and back.
struct Pass {
  Mlp::Activations a;
  std::vector<float> din, dweights;

  Pass(const Kernels& kernels, const std::vector<int>& widths, int rows) {
    Mlp mlp;
    mlp.create(widths, 3);
    const auto in = noise(static_cast<std::size_t>(rows * mlp.in()), 31),
               dout = noise(static_cast<std::size_t>(rows * mlp.out()), 32);
    din.resize(in.size());
    dweights.resize(mlp.weights.size());
    std::vector<float> scratch_a, scratch_b;
    mlp.forward(kernels, rows, in.data(), a);
    mlp.backward(kernels, rows, in.data(), a, dout.data(), din.data(), scratch_a, scratch_b,
                 dweights.data());
  }
};

double relative_error(const std::vector<float>& a, const std::vector<float>& b, std::size_t count) {
  double difference = 0, size = 0;
  for (std::size_t k = 0; k < count; ++k) {
    difference += std::pow(double{a[k]} - b[k], 2);
    size += std::pow(double{b[k]}, 2);
  }
  return std::sqrt(difference / size);
}

TEST(AmxLayers, OfWholePerceptronsAreThoseOfFloatWithinAPercent) {
  for (const std::vector<int>& widths : {std::vector{32, 64, 16},
                                         {32, 64, 64, 16},
                                         {32, 32, 16},
                                         {64, 128, 16},
                                         {32, 128, 128, 16}}) {
    const int rows = 203;
    const Pass amx(emulated_amx(), widths, rows), exact(kernels_avx2(), widths, rows);
    EXPECT_LT(relative_error(amx.a.back(), exact.a.back(), static_cast<std::size_t>(rows * 16)),
              0.01);
    // Units whose sign the rounding changes let through a gradient that the other has not.
    EXPECT_LT(relative_error(amx.din, exact.din, exact.din.size()), 0.08);
    EXPECT_LT(relative_error(amx.dweights, exact.dweights, exact.dweights.size()), 0.08);
  }
}

// The kernels as compiled. Where the processor has no tiles, each of their instructions is decoded
// and done by the machine above; where it has, this compares the two.
TEST(AmxLayers, AsCompiledGiveWhatTheEmulationGives) {
  if (best_isa() < Isa::avx512bf16)
    GTEST_SKIP() << "this processor has no AVX-512 with bf16, as the kernels need around tiles";
  for (const Widths w : all_widths)
    for (const int rows : {1, 33, 130}) {
      if (w.in * w.out > 128 * 128 && rows > 33) continue;
      const Case c(w.in, w.out, rows);
      for (const bool relu : {false, true}) {
        const Results expected = c.run(emulated_amx(), relu);
        const test::TileTrap trap;
        const Results compiled = c.run(kernels_amx(), relu);
        EXPECT_FALSE(trap.configured()) << "the tiles were not released";
        if (best_isa() == Isa::amx) {
          EXPECT_EQ(trap.executed(), 0);
        } else {
          EXPECT_GT(trap.executed(), 3 * 5)
              << "at least configure, load, multiply, store and release, thrice";
        }
        EXPECT_EQ(compiled.out, expected.out) << w.in << "-" << w.out << " x " << rows;
        EXPECT_EQ(compiled.din, expected.din) << w.in << "-" << w.out << " x " << rows;
        EXPECT_EQ(compiled.dweights, expected.dweights) << w.in << "-" << w.out << " x " << rows;
      }
    }
}

}  // namespace
}  // namespace orbitfuse::nerf
