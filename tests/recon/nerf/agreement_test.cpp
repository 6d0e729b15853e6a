// SPDX-License-Identifier: BSD-3-Clause
// Ways to the same answer that must agree: float and double, short cuts and the long way, the
// precisions of the kernels.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/parallel.hpp"
#include "recon/nerf/compositing.hpp"
#include "recon/nerf/ray_block.hpp"
#include "recon/nerf/random.hpp"
#include "recon/nerf/render.hpp"
#include "recon/nerf/trainer.hpp"
#include "tests/recon/nerf/toy_scene.hpp"

namespace orbitfuse::nerf {
namespace {

using test::toy_options;
using test::toy_scene;

TEST(Agreement, TransmittanceAndItsGradientInFloatFollowDouble) {
  for (std::uint64_t ray = 0; ray < 300; ++ray) {
    const int count = 1 + static_cast<int>(ray % 48);
    // From nothing to walls, steps from 1e-12 to 1.
    std::vector<float> sigma, dt, pull, w(48), light(48), slope(48);
    for (int i = 0; i < count; ++i) {
      const auto at = ray * 64 + static_cast<unsigned>(i);
      const float u = random_uniform(1, 1, at);
      sigma.push_back(u < 0.1f ? 0.0f : u > 0.95f ? 1e6f : std::pow(10.0f, 8 * u - 6));
      dt.push_back(std::pow(10.0f, -12 * random_uniform(1, 2, at)));
      pull.push_back(random_uniform(1, 3, at) - 0.5f);
    }
    const int used = composite(count, sigma.data(), dt.data(), 1e-4f, w.data(), light.data());
    composite_backward(used, dt.data(), w.data(), light.data(), pull.data(), 0.1f, slope.data());
    const std::vector<double> sigma_d(sigma.begin(), sigma.end()), dt_d(dt.begin(), dt.end()), pull_d(pull.begin(), pull.end());
    std::vector<double> w_d(48), light_d(48), slope_d(48);
    composite(used, sigma_d.data(), dt_d.data(), 0.0, w_d.data(), light_d.data());
    composite_backward(used, dt_d.data(), w_d.data(), light_d.data(), pull_d.data(), 0.1, slope_d.data());
    for (std::size_t i = 0; i < static_cast<std::size_t>(used); ++i) {
      EXPECT_NEAR(w[i], w_d[i], 2e-6) << ray;
      EXPECT_NEAR(light[i], light_d[i], 2e-6) << ray;
      EXPECT_NEAR(slope[i], slope_d[i], 1e-5 * dt_d[i]) << ray;
    }
  }
}

Field trained(const Dataset& data, int iterations) {
  Field field;
  EXPECT_TRUE(train(data, toy_options(data.modality, iterations), {}, field));
  return field;
}

TEST(Agreement, FrontToBackWithStopsIsTheWholeRay) {
  Dataset data = toy_scene(Modality::visible, 8);
  data.depth = test::toy_depth(data);
  Field field = trained(data, 150);
  FieldState& state = field.state();
  // Walls instead of the mist of a short training: twice the logarithm of the density.
  const Mlp::Layer& last = state.main.mlp.layers.back();
  for (int i = 0; i < last.in; ++i)
    state.main.mlp.weights.value[static_cast<std::size_t>(last.offset + i * last.out)] *= 2;
  state.refresh();
  const Kernels& kernels = kernels_for(best_isa());
  const ViewRays rays(data.views[1].camera, data.views[1].cam_from_world, state.space);
  RayBlock shortened, whole;
  shortened.clear();
  whole.clear();
  int count = 0;
  for (int y = 0; y < data.views[1].camera.height; y += 2)
    for (int x = 0; x < data.views[1].camera.width; x += 2) {
      Ray ray;
      if (!rays.ray(x + 0.5, y + 0.5, ray)) continue;
      shortened.add(state, ray, state.march_settings(), 0.5f);
      whole.add(state, ray, state.march_settings(), 0.5f);
      ++count;
    }
  forward(state, kernels, {1e-4f, 1e-4f, false}, shortened);
  forward(state, kernels, {0.0f, 0.0f, false}, whole);
  EXPECT_LT(shortened.samples(), whole.samples()) << "nothing was skipped";
  int row_a = 0, row_b = 0;
  double worst = 0;
  for (int r = 0; r < count; ++r) {
    float a[3], b[3];
    ray_value(state, shortened, r, row_a, a);
    ray_value(state, whole, r, row_b, b);
    for (int c = 0; c < 3; ++c) worst = std::max(worst, std::abs(double{a[c]} - b[c]));
  }
  // What is left out weighs at most 1e-4 a sample, and 1e-4 behind the last.
  EXPECT_LT(worst, 4e-3);
}

TEST(Agreement, LookingAheadChangesNoPicture) {
  Dataset data = toy_scene(Modality::visible, 8, 1.0, 96);
  data.depth = test::toy_depth(data);
  const Field field = trained(data, 150);
  const auto quick = render(field, data.views[1].camera, data.views[1].cam_from_world, {}, {});
  const auto slow = render(field, data.views[1].camera, data.views[1].cam_from_world, {.look_ahead = false}, {});
  ASSERT_TRUE(quick && slow);
  EXPECT_GT(cv::norm(quick->color, slow->color, cv::NORM_INF), 0) << "nothing was skipped";
  // Samples lie elsewhere on a shorter ray, so the two differ as two jitters do.
  const double rms = cv::norm(quick->color, slow->color, cv::NORM_L2) / std::sqrt(3.0 * 96 * 96);
  EXPECT_LT(rms, 0.03);
}

// The perceptrons' sums in double, from their definitions. The table is stored in half precision
// and the rest of the step is float in all of them.

void double_encode(const GridLevel& level, const std::uint16_t* table, const float* position, int count,
                   float* out, int stride) {
  kernels_avx2().encode(level, table, position, count, out, stride);  // half precision is what is stored
}

void double_forward(const LayerView& layer, int rows, const float* in, float* out, bool relu) {
  std::vector<double> sum(static_cast<std::size_t>(layer.out));
  for (int r = 0; r < rows; ++r) {
    std::fill(sum.begin(), sum.end(), 0.0);
    for (int i = 0; i < layer.in; ++i)
      for (int o = 0; o < layer.out; ++o)
        sum[static_cast<std::size_t>(o)] += double{in[r * layer.in + i]} * layer.weights[i * layer.out + o];
    for (int o = 0; o < layer.out; ++o) {
      const double value = sum[static_cast<std::size_t>(o)];
      out[r * layer.out + o] = static_cast<float>(relu ? std::max(0.0, value) : value);
    }
  }
}

void double_backward_input(const LayerView& layer, int rows, const float* dout, float* din, const float* activation) {
  std::vector<double> sum(static_cast<std::size_t>(layer.in));
  for (int r = 0; r < rows; ++r) {
    std::fill(sum.begin(), sum.end(), 0.0);
    for (int o = 0; o < layer.out; ++o)
      for (int i = 0; i < layer.in; ++i)
        sum[static_cast<std::size_t>(i)] += double{dout[r * layer.out + o]} * layer.transposed[o * layer.in + i];
    for (int i = 0; i < layer.in; ++i) {
      const bool off = activation != nullptr && activation[r * layer.in + i] <= 0;
      din[r * layer.in + i] = off ? 0.0f : static_cast<float>(sum[static_cast<std::size_t>(i)]);
    }
  }
}

void double_backward_weights(const LayerView& layer, int rows, const float* in, const float* dout, float* dweights) {
  std::vector<double> sum(dweights, dweights + layer.in * layer.out);
  for (int r = 0; r < rows; ++r)
    for (int i = 0; i < layer.in; ++i)
      for (int o = 0; o < layer.out; ++o)
        sum[static_cast<std::size_t>(i * layer.out + o)] += double{in[r * layer.in + i]} * dout[r * layer.out + o];
  for (std::size_t i = 0; i < sum.size(); ++i) dweights[i] = static_cast<float>(sum[i]);
}

/// Error of a view that didn't train, after a short training with these kernels.
double psnr_with(Dataset data, const Kernels& kernels) {
  TrainOptions options = toy_options(data.modality, 200);
  options.hidden = options.color_hidden = 16;
  options.samples_per_step = 8192;
  options.haze_samples = 8;
  FieldState state;
  state.create(options, data.modality, static_cast<int>(data.views.size()));
  data.views[0].measure_only = true;
  const std::vector<bool> heldout = heldout_views(data, 0);
  const Dataset training = training_part(data, heldout);
  state.space = estimate_space(training);
  state.span = estimate_span(training);
  const auto views = prepare_views(data, state.space, state.span);
  carve(training.has_dense_depth(), views, heldout, options, state.occupancy);
  Trainer trainer(state, views, heldout, kernels);
  for (int i = 0; i < options.iterations; ++i) EXPECT_TRUE(trainer.step(i / double(options.iterations)));
  return psnr_of(state, views[0], 1);
}

TEST(Agreement, PerceptronsInFloatBfloatAndDoubleTrainWithinAFifthOfADecibel) {
  Dataset data = toy_scene(Modality::visible, 10);
  data.depth = test::toy_depth(data);
  Kernels in_double = kernels_avx2();
  in_double.encode = double_encode;
  in_double.forward = double_forward;
  in_double.backward_input = double_backward_input;
  in_double.backward_weights = double_backward_weights;
  const double reference = psnr_with(data, in_double);
  EXPECT_GT(reference, 14);  // the background alone gives 11
  for (const Isa isa : {Isa::avx2, Isa::avx512, Isa::avx512bf16})
    if (isa <= best_isa()) {
      EXPECT_NEAR(psnr_with(data, kernels_for(isa)), reference, 0.2) << name(isa);
    }
}

TEST(Agreement, ManyThreadsGiveWhatOneGives) {
  const Dataset data = toy_scene(Modality::thermal, 6);
  Field fields[2];
  for (int k = 0; k < 2; ++k) {
    set_thread_count(k == 0 ? 1 : 7);
    ASSERT_TRUE(train(data, toy_options(Modality::thermal, 60), {}, fields[k]));
  }
  set_thread_count(0);
  EXPECT_EQ(fields[0].state().main.grid.table.value, fields[1].state().main.grid.table.value);
}

TEST(Agreement, WithoutHeldOutViewsTheLastStepIsKept) {
  const Dataset data = toy_scene(Modality::visible, 4);
  TrainOptions options = toy_options(Modality::visible, 20);
  options.target_psnr = 1;  // nothing measures, so nothing can reach it
  options.plateau_db = 0.1;
  Field field;
  const auto report = train(data, options, {}, field);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->iterations, 20);
  EXPECT_EQ(report->best_step, 20);
  EXPECT_TRUE(std::isnan(report->best_psnr));
}

TEST(Agreement, EightBitThermalKeepsItsGrayValues) {
  Dataset data = toy_scene(Modality::thermal, 10);
  data.thermal_is_gray = true;
  for (TrainingView& view : data.views) view.image = (view.image - 285) * 10;  // 0..255
  data.depth = test::toy_depth(data);
  const Field field = trained(data, 150);
  const auto view = render(field, data.views[0].camera, data.views[0].cam_from_world, {}, {});
  ASSERT_TRUE(view);
  const int middle = data.views[0].camera.width / 2;
  EXPECT_NEAR(view->color.at<float>(middle, middle), data.views[0].image.at<float>(middle, middle), 20);
  EXPECT_NEAR(view->color.at<float>(1, 1), 50, 20);
}

TEST(Agreement, GridParametersStayWithinHalfPrecision) {
  for (const Isa isa : {Isa::avx2, Isa::avx512, Isa::avx512bf16}) {
    if (isa > best_isa()) continue;
    HashEncoding grid;
    grid.create(1, 4, 8, 4, 4, 1);
    const auto count = static_cast<std::int64_t>(grid.table.size());
    AdamStep step;
    step.learning_rate = 1e9f;
    // A step past the range of half precision, then gradients whose squares are infinite, and NaN.
    for (const float gradient : {1.0f, 1e30f, std::numeric_limits<float>::infinity(), std::nanf("")}) {
      for (std::size_t i = 0; i < grid.table.size(); ++i) grid.table.grad[i] = i % 2 ? gradient : -gradient;
      kernels_for(isa).adam(step, count, grid.table.value.data(), grid.table.first.data(),
                            grid.table.second.data(), grid.table.grad.data(), grid.half.data());
      if (gradient == 1.0f) {
        EXPECT_EQ(std::abs(grid.table.value[0]), max_half) << "the step was to pass it, " << name(isa);
      }
    }
    for (std::size_t i = 0; i < grid.table.size(); ++i) {
      EXPECT_LE(std::abs(grid.table.value[i]), max_half) << name(isa);
      EXPECT_LT(grid.half[i] & 0x7fff, 0x7c00) << "infinite half, " << name(isa);
    }
  }
}

}  // namespace
}  // namespace orbitfuse::nerf
