// SPDX-License-Identifier: BSD-3-Clause
// Analytic gradients against central differences.
#include <gtest/gtest.h>

#include <cmath>

#include "core/numeric/random.hpp"
#include "recon/nerf/kernels/compositing.hpp"
#include "recon/nerf/training/backward.hpp"
#include "tests/recon/nerf/slope.hpp"

namespace orbitfuse::nerf {
namespace {

std::vector<double> random_values(std::size_t count, std::uint64_t seed) {
  std::vector<double> out(count);
  for (std::size_t i = 0; i < count; ++i) out[i] = random_uniform(seed, 98, i);
  return out;
}

TEST(Compositing, DensityGradientMatchesDifferencesInDouble) {
  const int n = 24;
  auto sigma = random_values(n, 1), dt = random_values(n, 2);
  const auto g = random_values(n, 3);
  const double behind_value = 0.7;
  std::vector<double> w(n), light(n), gradient(n);
  const auto loss = [&] {
    composite<double>(n, sigma.data(), dt.data(), 0.0, w.data(), light.data());
    double sum = light.back() * behind_value;
    for (int i = 0; i < n; ++i)
      sum += w[static_cast<std::size_t>(i)] * g[static_cast<std::size_t>(i)];
    return sum;
  };
  loss();
  composite_backward<double>(n, dt.data(), w.data(), light.data(), g.data(),
                             light.back() * behind_value, gradient.data());
  for (std::size_t i = 0; i < n; ++i) {
    const double kept = sigma[i], h = 1e-6;
    sigma[i] = kept + h;
    const double up = loss();
    sigma[i] = kept - h;
    const double down = loss();
    sigma[i] = kept;
    EXPECT_NEAR(gradient[i], (up - down) / (2 * h), 1e-9);
  }
}

TEST(Compositing, WeightsAndTransmittanceSumToOneAtEveryScale) {
  for (const double scale : {0.0, 1e-12, 1e-3, 1.0, 1e3, 1e6}) {
    const int n = 40;
    std::vector<float> sigma(n), dt(n), w(n), light(n);
    for (std::size_t i = 0; i < n; ++i) {
      sigma[i] = static_cast<float>(scale * random_uniform(4, 1, i));
      dt[i] = i % 3 == 0 ? 1e-12f : 0.01f;
    }
    const int used = composite(n, sigma.data(), dt.data(), 1e-4f, w.data(), light.data());
    double sum = light[static_cast<std::size_t>(used - 1)], reference = 1;
    for (int i = 0; i < used; ++i) {
      const auto k = static_cast<std::size_t>(i);
      sum += w[k];
      reference *= std::exp(-double{sigma[k]} * dt[k]);
      EXPECT_NEAR(light[k], reference, 1e-6) << scale;
    }
    EXPECT_NEAR(sum, 1, 1e-6) << scale;
  }
}

TEST(Distortion, IsTheDoubleSumOfEquation15AndItsGradient) {
  const int n = 17;
  auto w = random_values(n, 5), s = random_values(n, 6), ds = random_values(n, 7);
  std::sort(s.begin(), s.end());
  const auto naive = [&] {
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i) {
      sum += w[i] * w[i] * ds[i] / 3;
      for (std::size_t j = 0; j < n; ++j) sum += w[i] * w[j] * std::abs(s[i] - s[j]);
    }
    return sum;
  };
  std::vector<double> gradient(n);
  EXPECT_NEAR(distortion_loss<double>(n, w.data(), s.data(), ds.data(), 1.0, gradient.data()),
              naive(), 1e-12);
  for (std::size_t i = 0; i < n; ++i) {
    const double kept = w[i], h = 1e-6;
    w[i] = kept + h;
    const double up = naive();
    w[i] = kept - h;
    const double down = naive();
    w[i] = kept;
    EXPECT_NEAR(gradient[i], (up - down) / (2 * h), 1e-8);
  }
}

/// A field with visible density, a few rays through it, and the whole loss.
class FieldGradient : public ::testing::TestWithParam<Modality> {
 protected:
  void SetUp() override {
    TrainOptions options;
    options.log2_table = 10;
    options.max_resolution = 64;
    options.levels = 4;
    options.color_layers = 2;
    options.occupancy_resolution = 16;
    field_.create(options, GetParam(), 3);
    // In steps of 2^-8, so that these and what the tests add are exact in half precision.
    for (std::size_t i = 0; i < field_.main.grid.table.size(); ++i)
      field_.main.grid.table.value(i) = std::round((random_uniform(8, 1, i) - 0.5f) * 256) / 256;
    field_.main.grid.level_weight[2] = 0.5f;  // coming in, coarse to fine
    field_.refresh();
    for (int r = 0; r < 12; ++r) {
      const float a = 0.5f * static_cast<float>(r);
      Ray ray{{std::cos(a), std::sin(a), 0.1f}, {-std::cos(a + 0.1f), -std::sin(a + 0.1f), 0}, 1};
      std::vector<float> t, dt;
      for (int i = 0; i < 10; ++i) {
        t.push_back(0.2f + 0.15f * static_cast<float>(i));
        dt.push_back(0.15f);
      }
      if (r == 0) block_.clear();
      block_.add(ray, t.data(), dt.data(), 10);
      RayTarget target;
      for (float& v : target.value) v = random_uniform(9, 2, static_cast<unsigned>(r));
      target.view = r % 3;
      target.distance = r % 2 ? 0.9f : 0.0f;
      target.depth_weight = 0.3f;
      targets_.push_back(target);
    }
    settings_.per_ray = 1.0f / 12;
    settings_.distortion_weight = 0.1f;
  }

  double loss(BlockGradients& gradients) {
    gradients.reset(field_);
    forward(field_, kernels_, {1e-9f, 0.0f}, block_);
    backward(field_, kernels_, settings_, targets_, block_, gradients, grid_);
    return settings_.per_ray *
           (color_loss() / field_.channels() + settings_.distortion_weight * gradients.distortion +
            gradients.depth);
  }

  /// From the definition: squared error, beyond `huber` its tangent.
  double color_loss() const {
    double sum = 0;
    int row = 0;
    for (std::size_t r = 0; r < targets_.size(); ++r) {
      float value[3];
      ray_value(field_, block_, static_cast<int>(r), row, value);
      for (int c = 0; c < field_.channels(); ++c) {
        const double offset =
            field_.image_offsets.value[static_cast<std::size_t>(targets_[r].view)];
        const double error = std::abs(double{value[c]} + offset - targets_[r].value[c]),
                     h = settings_.huber;
        sum += h > 0 && error > h ? 2 * h * error - h * h : error * error;
      }
    }
    return sum;
  }

  std::vector<float> table_gradient() const {
    return test::table_gradient(kernels_, field_.main.grid, block_.position01.data(),
                                block_.samples(), grid_.data());
  }

  double moved_loss() {
    field_.refresh();
    BlockGradients unused;
    return loss(unused);
  }

  void check(Parameters& parameters, const std::vector<float>& gradient) {
    test::expect_slope(parameters.value, gradient, 3e-3, 0.01, [&] { return moved_loss(); });
    field_.refresh();
  }

  const Kernels& kernels_ = kernels_for(Isa::avx2);
  FieldState field_;
  RayBlock block_;
  std::vector<RayTarget> targets_;
  LossSettings settings_;
  std::vector<float> grid_;
};

TEST_P(FieldGradient, OfColourDistortionAndDepthLossMatchesDifferences) {
  BlockGradients gradients;
  loss(gradients);
  ASSERT_TRUE(gradients.finite);
  EXPECT_GT(gradients.distortion, 0);
  EXPECT_NE(gradients.depth, 0);
  check(field_.main.mlp.weights, gradients.mlp);
  check(field_.color.weights, gradients.color);
  check(field_.image_offsets, gradients.offsets);
}

TEST_P(FieldGradient, OfTheHashTableMatchesDifferences) {
  BlockGradients gradients;
  loss(gradients);
  // The table is read in half precision, so the step must be large against 2^-11.
  std::vector<float> values = field_.main.grid.table.values();
  test::expect_slope(values, table_gradient(), 0.05, 0.03, [&] {
    field_.main.grid.table.set_values(values);
    return moved_loss();
  });
}

TEST_P(FieldGradient, OfEachPartAloneMatchesDifferencesAlongAnyDirection) {
  for (const float huber : {0.0f, 0.1f}) {
    SCOPED_TRACE(huber);
    settings_.huber = huber;
    BlockGradients gradients;
    loss(gradients);
    const auto moved = [&] { return moved_loss(); };
    const auto check_parts = [&](std::vector<float>& values, const std::vector<float>& gradient,
                                 const std::vector<test::Part>& parts, float step) {
      test::expect_random_slopes(values, gradient, parts, step, 0.06, moved);
      field_.refresh();
    };
    {
      SCOPED_TRACE("table");
      HashEncoding& grid = field_.main.grid;
      std::vector<float> values = grid.table.values();
      test::expect_random_slopes(values, table_gradient(), test::levels_of(grid), 1.0f / 2048, 0.06,
                                 [&] {
                                   grid.table.set_values(values);
                                   return moved_loss();
                                 });
      grid.table.set_values(values);
      field_.refresh();
    }
    {
      SCOPED_TRACE("density network");
      check_parts(field_.main.mlp.weights.value, gradients.mlp, test::layers_of(field_.main.mlp),
                  1e-4f);
    }
    {
      SCOPED_TRACE("colour network");
      check_parts(field_.color.weights.value, gradients.color, test::layers_of(field_.color),
                  1e-4f);
    }
    {
      SCOPED_TRACE("offsets");
      check_parts(field_.image_offsets.value, gradients.offsets, {{"one", 1, 1}, {"another", 2, 1}},
                  1e-3f);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(EveryModality, FieldGradient,
                         ::testing::Values(Modality::visible, Modality::thermal),
                         [](const auto& instance) { return std::string(name(instance.param)); });

}  // namespace
}  // namespace orbitfuse::nerf
