// SPDX-License-Identifier: BSD-3-Clause
// Ways to the same answer that must agree: float and double, short cuts and the long way, the
// precisions of the kernels.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "core/numeric/random.hpp"
#include "core/system/parallel.hpp"
#include "recon/nerf/kernels/compositing.hpp"
#include "recon/nerf/rendering/ray_block.hpp"
#include "recon/nerf/rendering/render.hpp"
#include "recon/nerf/training/measure.hpp"
#include "recon/nerf/training/trainer.hpp"
#include "tests/recon/nerf/kernels/emulated_amx.hpp"
#include "tests/support/toy_scene.hpp"

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
    const std::vector<double> sigma_d(sigma.begin(), sigma.end()), dt_d(dt.begin(), dt.end()),
        pull_d(pull.begin(), pull.end());
    std::vector<double> w_d(48), light_d(48), slope_d(48);
    composite(used, sigma_d.data(), dt_d.data(), 0.0, w_d.data(), light_d.data());
    composite_backward(used, dt_d.data(), w_d.data(), light_d.data(), pull_d.data(), 0.1,
                       slope_d.data());
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
  std::vector<DrawnRay> drawn;
  for (int y = 0; y < data.views[1].camera.height; y += 2)
    for (int x = 0; x < data.views[1].camera.width; x += 2) {
      DrawnRay ray;
      if (rays.ray(x + 0.5, y + 0.5, ray.ray)) drawn.push_back(ray);
    }
  shortened.add(state.occupancy, state.march_settings(), drawn);
  whole.add(state.occupancy, state.march_settings(), drawn);
  forward(state, kernels, {1e-4f, 1e-4f, false}, shortened);
  forward(state, kernels, {0.0f, 0.0f, false}, whole);
  EXPECT_LT(shortened.samples(), whole.samples()) << "nothing was skipped";
  int row_a = 0, row_b = 0;
  double worst = 0;
  for (int r = 0; r < static_cast<int>(drawn.size()); ++r) {
    float a[3], b[3];
    ray_value(state, shortened, r, row_a, a);
    ray_value(state, whole, r, row_b, b);
    for (int c = 0; c < 3; ++c) worst = std::max(worst, std::abs(double{a[c]} - b[c]));
  }
  // What is left out weighs at most 1e-4 a sample, and 1e-4 behind the last.
  EXPECT_LT(worst, 4e-3);
}

double rms_of(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_L2) / std::sqrt(static_cast<double>(a.total()) * a.channels());
}

TEST(Agreement, LookingAheadIsAsNearToTheWholePictureAsNotLooking) {
  Dataset data = toy_scene(Modality::visible, 8, 1.0, 96);
  data.depth = test::toy_depth(data);
  const Field field = trained(data, 150);
  const auto shown = [&](const RenderOptions& options) {
    return render(field, data.views[1].camera, data.views[1].cam_from_world, options, {}).value();
  };
  const RenderedView quick = shown({}), slow = shown({.look_ahead = false});
  const RenderedView fine =
      shown({.stop_transmittance = 1e-5, .sample_factor = 8, .look_ahead = false});
  EXPECT_GT(cv::norm(quick.color, slow.color, cv::NORM_INF), 0) << "nothing was skipped";
  // Its samples lie closer, since they are spread over less.
  EXPECT_LT(rms_of(quick.color, fine.color), 1.05 * rms_of(slow.color, fine.color));
  EXPECT_LT(rms_of(quick.opacity, fine.opacity), 1.05 * rms_of(slow.opacity, fine.opacity) + 1e-3);
  // Beside the ball's edge, where neighbours stop and the ray itself goes on, no background is
  // lost.
  int solid = 0, deep_quick = 0, deep_slow = 0, edge = 0;
  double edge_quick = 0, edge_slow = 0;
  const cv::Mat ball = data.depth[1].depth == data.depth[1].depth;
  cv::Mat wide;
  cv::dilate(ball, wide, cv::Mat::ones(9, 9, CV_8U));
  for (int y = 0; y < 96; ++y)
    for (int x = 0; x < 96; ++x) {
      const cv::Vec3f truth = fine.color.at<cv::Vec3f>(y, x);
      if (wide.at<uchar>(y, x) && !ball.at<uchar>(y, x)) {
        ++edge;
        edge_quick += cv::norm(quick.color.at<cv::Vec3f>(y, x) - truth);
        edge_slow += cv::norm(slow.color.at<cv::Vec3f>(y, x) - truth);
      }
      if (!ball.at<uchar>(y, x) || !(fine.opacity.at<float>(y, x) > 0.9f)) continue;
      const float depth = fine.depth.at<float>(y, x);
      ++solid;
      deep_quick += std::abs(quick.depth.at<float>(y, x) - depth) < 0.03f;
      deep_slow += std::abs(slow.depth.at<float>(y, x) - depth) < 0.03f;
    }
  EXPECT_GT(edge, 100);
  EXPECT_LT(edge_quick, 1.05 * edge_slow);
  EXPECT_GT(solid, 500);
  EXPECT_GT(deep_quick, 0.98 * deep_slow);
  EXPECT_GT(deep_quick, 0.8 * solid);
}

/// Of a picture that is waited for: nearly as good, and no pixel is missing.
TEST(Agreement, PixelsBetweenAlikeNeighboursAreTheirMean) {
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    Dataset data = toy_scene(modality, 8, 1.0, 96);
    data.depth = test::toy_depth(data);
    const Field field = trained(data, 150);
    const auto shown = [&](double alike) {
      return render(field, data.views[1].camera, data.views[1].cam_from_world, {.alike = alike}, {})
          .value();
    };
    const RenderedView all = shown(0), exact = shown(1e-9), quick = shown(0.05);
    const double range =
        modality == Modality::visible ? 1 : field.state().span.high - field.state().span.low;
    // Where none are alike all are rendered, and what looks ahead for the others as finely as they:
    // seen as dots at the edges of real pictures otherwise.
    EXPECT_LT(rms_of(exact.color, all.color), 0.01 * range);
    const cv::Mat off_full = cv::abs(exact.color.reshape(1) - all.color.reshape(1));
    double ahead = 0, others = 0;
    for (int y = 0; y < 96; ++y)
      for (int x = 0; x < off_full.cols; ++x)
        (y % 4 == 0 && x / exact.color.channels() % 4 == 0 ? ahead : others) +=
            static_cast<double>(off_full.at<float>(y, x));
    EXPECT_LT(15 * ahead, 2 * others + 1e-6);
    EXPECT_LT(rms_of(quick.color, exact.color), 0.005 * range);
    // A detail between four alike neighbours is missed.
    EXPECT_LT(cv::norm(quick.color, exact.color, cv::NORM_INF), 0.15 * range);
    const cv::Mat known = quick.opacity >= 0;
    EXPECT_EQ(cv::countNonZero(known), 96 * 96);
    EXPECT_EQ(cv::countNonZero(quick.color.reshape(1) == quick.color.reshape(1)),
              96 * 96 * quick.color.channels());
    int meant = 0, off_lattice = 0;
    const int channels = quick.color.channels();
    for (int y = 1; y < 95; ++y)
      for (int x = 1; x < 95; ++x) {
        const float *ours = quick.color.ptr<float>(y) + x * channels,
                    *rendered = exact.color.ptr<float>(y) + x * channels;
        const bool same = std::equal(ours, ours + channels, rendered);
        meant += !same;
        off_lattice += !same && (x % 2 != 0 || y % 2 != 0 || (x % 4 == 0 && y % 4 == 0));
      }
    EXPECT_GT(meant, 500) << "nothing was spared";
    EXPECT_EQ(meant, off_lattice);
  }
}

TEST(Agreement, LookingAheadSeesThroughAHoleThatItsNeighboursMiss) {
  Dataset data = toy_scene(Modality::visible, 8, 1.0, 96);
  data.depth = test::toy_depth(data);
  TrainOptions options = toy_options(data.modality, 150);
  options.occupancy_resolution = 128;
  Field field;
  ASSERT_TRUE(train(data, options, {}, field));
  FieldState& state = field.state();
  const Mlp::Layer& last = state.main.mlp.layers.back();  // a wall, not mist: see above
  for (int i = 0; i < last.in; ++i)
    state.main.mlp.weights.value[static_cast<std::size_t>(last.offset + i * last.out)] *= 2;
  state.refresh();
  const auto shown = [&](bool look_ahead) {
    return render(field, data.views[0].camera, data.views[0].cam_from_world,
                  {.look_ahead = look_ahead}, {})
        .value();
  };
  const cv::Rect hole(47, 47, 2, 2);
  const cv::Mat closed = shown(true).color(hole);
  // A tunnel of 2 x 2 cells along the first camera's axis, narrower than the rays that look ahead
  // are apart.
  Occupancy& grid = state.occupancy;
  for (float along = -1 + grid.cell_size(0) / 2; along < 1; along += grid.cell_size(0))
    for (const float y : {-0.5f, 0.5f})
      for (const float z : {-0.5f, 0.5f}) {
        const float x[3] = {along, y * grid.cell_size(0), z * grid.cell_size(0)};
        Occupancy::put(grid.on, grid.cell_of(0, x), false);
      }
  grid.refresh();
  const cv::Mat quick = shown(true).color(hole), slow = shown(false).color(hole);
  EXPECT_GT(rms_of(slow, closed), 0.1) << "there is a hole";
  EXPECT_LT(rms_of(quick, slow), 0.02);
}

// Every kernel in double, from its definition. What lies between them is stored as in any training:
// parameters and activations in float, the table in half precision. Compositing and its gradient in
// float are held to double above.

struct Corner {
  std::size_t first;  ///< its first feature in the level
  double weight;
};

/// The corners of a point's cell (Müller et al., eq. 4).
std::array<Corner, 8> corners_of(const GridLevel& level, const float* position) {
  std::uint32_t base[3];
  double part[3];
  for (int d = 0; d < 3; ++d) {
    const double x = std::clamp(double{position[d]}, 0.0, 1.0) * level.resolution;
    base[d] = static_cast<std::uint32_t>(std::min<double>(std::floor(x), level.resolution - 1));
    part[d] = x - base[d];
  }
  std::array<Corner, 8> out;
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    double weight = 1;
    std::uint32_t at[3];
    for (std::uint32_t d = 0; d < 3; ++d) {
      const std::uint32_t up = corner >> d & 1u;
      at[d] = base[d] + up;
      weight *= up ? part[d] : 1 - part[d];
    }
    const auto n = static_cast<std::uint32_t>(level.resolution) + 1;
    const std::uint32_t entry =
        level.dense ? at[0] + n * (at[1] + n * at[2])
                    : (at[0] ^ at[1] * 2654435761u ^ at[2] * 805459861u) & level.mask;
    out[corner] = {std::size_t{entry} * static_cast<std::size_t>(level.features), weight};
  }
  return out;
}

void double_encode(const GridLevel& level, const std::uint16_t* table, const float* position,
                   int count, float* out, int stride) {
  for (int s = 0; s < count; ++s) {
    double sum[4] = {0, 0, 0, 0};
    for (const Corner& corner : corners_of(level, position + 3 * s))
      for (int f = 0; f < level.features; ++f)
        sum[f] += corner.weight * static_cast<float>(std::bit_cast<cv::float16_t>(
                                      table[corner.first + static_cast<std::size_t>(f)]));
    for (int f = 0; f < level.features; ++f) out[s * stride + f] = static_cast<float>(sum[f]);
  }
}

void double_scatter(const GridLevel& level, GridLine* lines, std::uint64_t* touched,
                    const float* position, int count, const float* dfeatures) {
  for (int s = 0; s < count; ++s)
    for (const Corner& corner : corners_of(level, position + 3 * s))
      for (int f = 0; f < level.features; ++f) {
        const std::size_t i = corner.first + static_cast<std::size_t>(f);
        touched[i / 256] |= std::uint64_t{1} << i / 4 % 64;
        float& g = lines[i / 4].grad[i % 4];
        g = static_cast<float>(g + corner.weight * dfeatures[s * level.features + f]);
      }
}

/// Kingma & Ba, algorithm 1, for the entries that have a gradient.
void double_adam(const AdamStep& step, std::int64_t count, float* parameter, float* first,
                 float* second, float* grad) {
  for (std::int64_t i = 0; i < count; ++i) {
    if (grad[i] == 0) continue;
    const double g = double{grad[i]} + double{step.weight_decay} * parameter[i];
    const double m = double{step.beta1} * first[i] + (1.0 - step.beta1) * g;
    const double v = double{step.beta2} * second[i] + (1.0 - step.beta2) * g * g;
    const double change = step.learning_rate * (m * step.correction1) /
                          (std::sqrt(v * step.correction2) + step.epsilon);
    parameter[i] = static_cast<float>(parameter[i] - change);
    first[i] = static_cast<float>(m);
    second[i] = static_cast<float>(v);
    grad[i] = 0;
  }
}

void double_adam_lines(const AdamStep& step, std::int64_t words, std::uint64_t* touched,
                       GridLine* lines, std::uint16_t* half) {
  for (std::int64_t i = 0; i < 64 * words; ++i) {
    if (!(touched[i / 64] >> i % 64 & 1u)) continue;
    GridLine& line = lines[i];
    double_adam(step, 4, line.value, line.first, line.second, line.grad);
    for (int f = 0; f < 4; ++f)
      half[4 * i + f] = std::bit_cast<std::uint16_t>(cv::float16_t(line.value[f]));
  }
  std::fill_n(touched, words, 0);
}

void double_forward(const LayerView& layer, int rows, const float* in, float* out, bool relu) {
  std::vector<double> sum(static_cast<std::size_t>(layer.out));
  for (int r = 0; r < rows; ++r) {
    std::fill(sum.begin(), sum.end(), 0.0);
    for (int i = 0; i < layer.in; ++i)
      for (int o = 0; o < layer.out; ++o)
        sum[static_cast<std::size_t>(o)] +=
            double{in[r * layer.in + i]} * layer.weights[i * layer.out + o];
    for (int o = 0; o < layer.out; ++o) {
      const double value = sum[static_cast<std::size_t>(o)];
      out[r * layer.out + o] = static_cast<float>(relu ? std::max(0.0, value) : value);
    }
  }
}

void double_backward_input(const LayerView& layer, int rows, const float* dout, float* din,
                           const float* activation) {
  std::vector<double> sum(static_cast<std::size_t>(layer.in));
  for (int r = 0; r < rows; ++r) {
    std::fill(sum.begin(), sum.end(), 0.0);
    for (int o = 0; o < layer.out; ++o)
      for (int i = 0; i < layer.in; ++i)
        sum[static_cast<std::size_t>(i)] +=
            double{dout[r * layer.out + o]} * layer.transposed[o * layer.in + i];
    for (int i = 0; i < layer.in; ++i) {
      const bool off = activation != nullptr && activation[r * layer.in + i] <= 0;
      din[r * layer.in + i] = off ? 0.0f : static_cast<float>(sum[static_cast<std::size_t>(i)]);
    }
  }
}

void double_backward_weights(const LayerView& layer, int rows, const float* in, const float* dout,
                             float* dweights) {
  std::vector<double> sum(dweights, dweights + layer.in * layer.out);
  for (int r = 0; r < rows; ++r)
    for (int i = 0; i < layer.in; ++i)
      for (int o = 0; o < layer.out; ++o)
        sum[static_cast<std::size_t>(i * layer.out + o)] +=
            double{in[r * layer.in + i]} * dout[r * layer.out + o];
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
  auto views = prepare_views(data, state.space, state.span);
  carve(training.has_dense_depth(), views, heldout, options, state.occupancy);
  Trainer trainer(state, views, heldout, kernels);
  for (int i = 0; i < options.iterations; ++i)
    EXPECT_TRUE(trainer.step(i / double(options.iterations)));
  return psnr_of(render_strided(state, views[0].rays, 1, {}), views[0].target, 1);
}

TEST(Agreement, KernelsInFloatBfloatAndDoubleTrainWithinAFifthOfADecibel) {
  Dataset data = toy_scene(Modality::visible, 10);
  data.depth = test::toy_depth(data);
  Kernels in_double = kernels_avx2();
  in_double.encode = double_encode;
  in_double.scatter = double_scatter;
  in_double.adam = double_adam;
  in_double.adam_lines = double_adam_lines;
  in_double.forward = double_forward;
  in_double.backward_input = double_backward_input;
  in_double.backward_weights = double_backward_weights;
  const double reference = psnr_with(data, in_double);
  EXPECT_GT(reference, 14);  // the background alone gives 11
  for (const Isa isa : {Isa::avx2, Isa::avx512, Isa::avx512bf16, Isa::amx})
    if (isa <= best_isa()) {
      EXPECT_NEAR(psnr_with(data, kernels_for(isa)), reference, 0.2) << name(isa);
    }
  if (best_isa() < Isa::amx) {
    EXPECT_NEAR(psnr_with(data, test::emulated_amx()), reference, 0.2) << "emulated AMX";
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
  EXPECT_EQ(fields[0].state().main.grid.table.values(), fields[1].state().main.grid.table.values());
}

TEST(Agreement, WithoutHeldOutViewsTheLastStepIsKept) {
  const Dataset data = toy_scene(Modality::visible, 4);
  TrainOptions options = toy_options(Modality::visible, 20);
  options.plateau_db = 0.1;  // nothing measures, so nothing falls
  Field field;
  const auto report = train(data, options, {}, field);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->iterations, 20);
  EXPECT_EQ(report->best_step, 20);
  EXPECT_TRUE(std::isnan(report->best_psnr));
  options.target_psnr = 20;
  const auto unmeasured = train(data, options, {}, field);
  ASSERT_FALSE(unmeasured);
  EXPECT_EQ(unmeasured.error().kind, ErrorKind::usage);
  EXPECT_NE(unmeasured.error().remedy.find("nerf.holdout_every"), std::string::npos);
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
  EXPECT_NEAR(view->color.at<float>(middle, middle), data.views[0].image.at<float>(middle, middle),
              20);
  EXPECT_NEAR(view->color.at<float>(1, 1), 50, 20);
}

TEST(Agreement, GridParametersStayWithinHalfPrecision) {
  for (const Isa isa : {Isa::avx2, Isa::avx512, Isa::avx512bf16, Isa::amx}) {
    if (isa > best_isa()) continue;
    HashEncoding grid;
    grid.create(1, 4, 8, 4, 4, 1);
    const GridTable::Level table = grid.table.level(grid.levels, 0);
    AdamStep step;
    step.learning_rate = 1e9f;
    // A step past the range of half precision, then gradients whose squares are infinite, and NaN.
    for (const float gradient :
         {1.0f, 1e30f, std::numeric_limits<float>::infinity(), std::nanf("")}) {
      for (std::size_t i = 0; i < grid.table.size(); ++i)
        table.lines[i / 4].grad[i % 4] = i % 2 ? gradient : -gradient;
      for (std::size_t i = 0; i < grid.table.size() / 4; ++i)
        table.touched[i / 64] |= std::uint64_t{1} << i % 64;
      kernels_for(isa).adam_lines(step, table.words, table.touched, table.lines, grid.half.data());
      if (gradient == 1.0f) {
        EXPECT_EQ(std::abs(grid.table.value(0)), max_half)
            << "the step was to pass it, " << name(isa);
      }
    }
    for (std::size_t i = 0; i < grid.table.size(); ++i) {
      EXPECT_LE(std::abs(grid.table.value(i)), max_half) << name(isa);
      EXPECT_LT(grid.half[i] & 0x7fff, 0x7c00) << "infinite half, " << name(isa);
    }
  }
}

}  // namespace
}  // namespace orbitfuse::nerf
