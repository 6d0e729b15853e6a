// SPDX-License-Identifier: BSD-3-Clause
// Every instruction set's and device's kernels against double-precision references.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/numeric/random.hpp"
#include "recon/nerf/field/network.hpp"
#include "recon/nerf/kernels/spherical_harmonics.hpp"
#include "tests/recon/nerf/device/machines.hpp"

namespace orbitfuse::nerf {
namespace {

std::vector<float> noise(std::size_t count, std::uint64_t seed, float scale = 1) {
  std::vector<float> out(count);
  for (std::size_t i = 0; i < count; ++i) out[i] = scale * (2 * random_uniform(seed, 99, i) - 1);
  return out;
}

double half(std::uint16_t bits) { return static_cast<float>(std::bit_cast<cv::float16_t>(bits)); }

/// Trilinear interpolation with Müller et al.'s hash (eq. 4), for one level.
std::vector<double> encode_reference(const HashEncoding& grid, std::size_t l, const float* p) {
  const GridLevel& level = grid.levels[l];
  std::vector<double> out(static_cast<std::size_t>(level.features));
  std::uint32_t base[3];
  double part[3];
  for (int d = 0; d < 3; ++d) {
    const double x = std::clamp(p[d], 0.0f, 1.0f) * static_cast<float>(level.resolution);
    base[d] = static_cast<std::uint32_t>(std::min<double>(std::floor(x), level.resolution - 1));
    part[d] = x - base[d];
  }
  for (unsigned corner = 0; corner < 8; ++corner) {
    double weight = 1;
    std::uint32_t at[3];
    for (unsigned d = 0; d < 3; ++d) {
      const bool up = corner >> d & 1;
      at[d] = base[d] + up;
      weight *= up ? part[d] : 1 - part[d];
    }
    const auto n = static_cast<std::uint32_t>(level.resolution) + 1;
    const std::uint32_t entry =
        level.dense ? at[0] + n * (at[1] + n * at[2])
                    : (at[0] ^ at[1] * 2654435761u ^ at[2] * 805459861u) & level.mask;
    for (int f = 0; f < level.features; ++f)
      out[static_cast<std::size_t>(f)] +=
          weight * half(grid.half[static_cast<std::size_t>(level.offset) +
                                  entry * static_cast<std::size_t>(level.features) +
                                  static_cast<std::size_t>(f)]);
  }
  return out;
}

class KernelsTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    kernels_ = test::kernels_named(GetParam());
    if (!kernels_) GTEST_SKIP() << "no " << GetParam() << " here";
  }
  const Kernels& kernels() const { return *kernels_; }
  /// Relative to the largest magnitude: fp32 rounding, or bf16's 8 bits of mantissa.
  double tolerance() const { return kernels().isa >= Isa::avx512bf16 ? 1e-2 : 2e-6; }

 private:
  std::optional<Kernels> kernels_;
};

TEST_P(KernelsTest, EncodingIsTrilinearAndHashedAsPublished) {
  for (const auto& [features, log2_table] :
       {std::pair{2, 10}, {4, 10}, {2, 18}, {4, 17}}) {  // in and beyond the caches
    HashEncoding grid;
    grid.create(6, features, log2_table, 4, 128, 3);
    grid.table.set_values(noise(grid.table.size(), 5));
    grid.refresh_half();
    const int count = 67;
    std::vector<float> positions = noise(3 * count, 6, 0.5f);
    for (float& x : positions) x += 0.5f;
    std::vector<float> out(static_cast<std::size_t>(count * grid.width));
    grid.encode(kernels(), positions.data(), count, out.data());
    for (int s = 0; s < count; ++s)
      for (std::size_t l = 0; l < grid.levels.size(); ++l) {
        const auto expected =
            encode_reference(grid, l, &positions[static_cast<std::size_t>(3 * s)]);
        for (std::size_t f = 0; f < expected.size(); ++f)
          ASSERT_NEAR(out[static_cast<std::size_t>(s * grid.width) + l * expected.size() + f],
                      expected[f], 1e-4)
              << "sample " << s << " level " << l;
      }
  }
}

// The encoding is linear in the table, so its gradient is its adjoint: <E t, d> = <t, E^T d>.
TEST_P(KernelsTest, ScatterIsTheAdjointOfTheEncoding) {
  for (const auto& [features, log2_table] : {std::pair{2, 9}, {4, 9}, {2, 18}, {4, 15}}) {
    HashEncoding grid;
    grid.create(5, features, log2_table, 4, 128, 3);
    grid.table.set_values(noise(grid.table.size(), 15));
    grid.refresh_half();
    const int count = 133;
    std::vector<float> positions = noise(3 * count, 16, 0.5f);
    for (float& x : positions) x += 0.5f;
    for (std::size_t l = 0; l < grid.levels.size(); ++l) {
      const GridLevel& level = grid.levels[l];
      const auto d = noise(static_cast<std::size_t>(count * features), 17);
      std::vector<float> out(static_cast<std::size_t>(count * features));
      kernels().encode(level, grid.half.data() + level.offset, positions.data(), count, out.data(),
                       features);
      GridTable table;
      table.resize(grid.levels);
      const GridTable::Level to = table.level(grid.levels, l);
      kernels().scatter(level, to.lines, to.touched, positions.data(), count, d.data());
      const std::vector<float> grad = table.part(&GridLine::grad);
      double left = 0, right = 0;
      for (std::size_t i = 0; i < d.size(); ++i) left += double{out[i]} * d[i];
      for (std::size_t i = 0; i < grad.size(); ++i) right += half(grid.half[i]) * grad[i];
      EXPECT_NEAR(left, right, 1e-3 * (1 + std::abs(left)));
      for (std::uint32_t i = 0; i < level.entries * static_cast<std::uint32_t>(features); ++i) {
        if (to.lines[i / 4].grad[i % 4] != 0) {
          ASSERT_TRUE(to.touched[i / 256] >> i / 4 % 64 & 1u) << i;
        }
      }
    }
  }
}

TEST_P(KernelsTest, LayersMatchDoublePrecision) {
  for (const int rows : {1, 7, 64, 130}) {
    Mlp mlp;
    mlp.create({32, 48}, 4);
    const auto in = noise(static_cast<std::size_t>(rows) * 32, 21),
               dout = noise(static_cast<std::size_t>(rows) * 48, 22);
    std::vector<float> out(static_cast<std::size_t>(rows) * 48),
        din(static_cast<std::size_t>(rows) * 32), dw(32 * 48);
    kernels().forward(mlp.view(0), rows, in.data(), out.data(), true);
    kernels().backward_input(mlp.view(0), rows, dout.data(), din.data(), in.data());
    kernels().backward_weights(mlp.view(0), rows, in.data(), dout.data(), dw.data());
    const float* w = mlp.weights.value.data();
    for (int r = 0; r < rows; ++r) {
      for (int o = 0; o < 48; ++o) {
        double sum = 0;
        for (int i = 0; i < 32; ++i)
          sum += double{in[static_cast<std::size_t>(r * 32 + i)]} * w[i * 48 + o];
        ASSERT_NEAR(out[static_cast<std::size_t>(r * 48 + o)], std::max(0.0, sum), 4 * tolerance());
      }
      for (int i = 0; i < 32; ++i) {
        double sum = 0;
        for (int o = 0; o < 48; ++o)
          sum += double{dout[static_cast<std::size_t>(r * 48 + o)]} * w[i * 48 + o];
        if (in[static_cast<std::size_t>(r * 32 + i)] <= 0) sum = 0;
        ASSERT_NEAR(din[static_cast<std::size_t>(r * 32 + i)], sum, 4 * tolerance());
      }
    }
    for (int i = 0; i < 32; ++i)
      for (int o = 0; o < 48; ++o) {
        double sum = 0;
        for (int r = 0; r < rows; ++r)
          sum += double{in[static_cast<std::size_t>(r * 32 + i)]} *
                 dout[static_cast<std::size_t>(r * 48 + o)];
        ASSERT_NEAR(dw[static_cast<std::size_t>(i * 48 + o)], sum,
                    4 * tolerance() * std::sqrt(rows));
      }
  }
}

TEST_P(KernelsTest, AdamFollowsThePaperAndLeavesUntouchedEntriesAlone) {
  const std::size_t n = 80;  // a multiple of 8, as Kernels::adam asks
  auto value = noise(n, 31), first = noise(n, 32, 0.1f), grad = noise(n, 33);
  std::vector<float> second(n, 0.04f);
  grad[5] = 0;
  const auto v0 = value, m0 = first, g0 = grad;
  AdamStep step;
  step.learning_rate = 0.01f;
  step.correction1 = 1.5f;
  step.correction2 = 1.2f;
  kernels().adam(step, n, value.data(), first.data(), second.data(), grad.data());
  EXPECT_EQ(value[5], v0[5]);
  EXPECT_EQ(first[5], m0[5]);
  for (std::size_t i = 0; i < n; ++i) {
    EXPECT_EQ(grad[i], 0);
    if (i == 5) continue;
    const double m = 0.9 * m0[i] + 0.1 * g0[i], v = 0.99 * 0.04 + 0.01 * g0[i] * g0[i];
    EXPECT_NEAR(value[i], v0[i] - 0.01 * 1.5 * m / (std::sqrt(1.2 * v) + 1e-15), 1e-5);
  }
}

TEST_P(KernelsTest, AdamOfLinesIsThatOfListsWhereALineIsTouched) {
  const std::size_t lines = 700, n = 4 * lines;  // odd numbers of lines in and between the words
  auto value = noise(n, 31), first = noise(n, 32, 0.1f), grad = noise(n, 33);
  std::vector<float> second(n, 0.04f);
  std::vector<GridLine> table(lines);
  std::vector<std::uint64_t> touched((lines + 63) / 64);
  std::vector<std::uint16_t> copy(n, 1);
  AdamStep step;
  step.learning_rate = 0.01f;
  step.correction1 = 1.5f;
  step.correction2 = 1.2f;
  const auto is_touched = [](std::size_t line) { return line % 7 == 3 || line / 64 == 5; };
  for (std::size_t i = 0; i < n; ++i) {
    if (!is_touched(i / 4) || i % 5 == 0) grad[i] = 0;
    GridLine& line = table[i / 4];
    line.value[i % 4] = value[i];
    line.first[i % 4] = first[i];
    line.second[i % 4] = second[i];
    line.grad[i % 4] = grad[i];
    if (is_touched(i / 4)) touched[i / 256] |= std::uint64_t{1} << i / 4 % 64;
  }
  kernels().adam(step, n, value.data(), first.data(), second.data(), grad.data());
  kernels().adam_lines(step, static_cast<std::int64_t>(touched.size()), touched.data(),
                       table.data(), copy.data());
  for (std::size_t i = 0; i < n; ++i) {
    const GridLine& line = table[i / 4];
    ASSERT_EQ(line.value[i % 4], value[i]) << i;
    ASSERT_EQ(line.first[i % 4], first[i]) << i;
    ASSERT_EQ(line.second[i % 4], second[i]) << i;
    ASSERT_EQ(line.grad[i % 4], 0) << i;
    if (is_touched(i / 4)) {
      ASSERT_NEAR(half(copy[i]), value[i], 1e-3) << i;
    } else {
      ASSERT_EQ(copy[i], 1) << "written without need, " << i;
    }
  }
  EXPECT_EQ(touched, std::vector<std::uint64_t>(touched.size()));
}

INSTANTIATE_TEST_SUITE_P(EveryMachine, KernelsTest,
                         ::testing::Values(name(Isa::avx2), name(Isa::avx512),
                                           name(Isa::avx512bf16), name(Isa::amx), "emulated",
                                           "cuda"),
                         [](const auto& instance) { return std::string(instance.param); });

// Orthonormal on the sphere: the quadrature of Y_i Y_j over many directions is the identity.
TEST(SphericalHarmonics, AreOrthonormal) {
  const int n = 20000;
  double gram[max_sh][max_sh] = {};
  for (int k = 0; k < n; ++k) {  // Fibonacci lattice
    const double z = 1 - (2 * k + 1.0) / n, r = std::sqrt(1 - z * z), a = k * 2.39996322972865332;
    const float d[3] = {static_cast<float>(r * std::cos(a)), static_cast<float>(r * std::sin(a)),
                        static_cast<float>(z)};
    float y[max_sh];
    spherical_harmonics(4, d, y);
    for (int i = 0; i < max_sh; ++i)
      for (int j = 0; j < max_sh; ++j) gram[i][j] += double{y[i]} * y[j] * 4 * 3.14159265358979 / n;
  }
  for (int i = 0; i < max_sh; ++i)
    for (int j = 0; j < max_sh; ++j) EXPECT_NEAR(gram[i][j], i == j, 2e-3) << i << " " << j;
}

}  // namespace
}  // namespace orbitfuse::nerf
