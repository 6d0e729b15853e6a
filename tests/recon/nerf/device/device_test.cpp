// SPDX-License-Identifier: BSD-3-Clause
// What a device makes of a field, against the processor: rays, single steps, refusals.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/numeric/random.hpp"
#include "recon/nerf/rendering/trace_rays.hpp"
#include "recon/nerf/training/trainer.hpp"
#include "tests/recon/nerf/device/machines.hpp"
#include "tests/recon/nerf/random_ray.hpp"
#include "tests/support/toy_scene.hpp"

namespace orbitfuse::nerf {
namespace {

class DeviceTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (!test::engine_named(GetParam())) GTEST_SKIP() << "no " << GetParam() << " here";
  }
  test::InUse in_use() const { return test::InUse(test::engine_named(GetParam())); }
};

/// A field, its views and a trainer of them.
struct Scene {
  FieldState field;
  std::vector<NormalisedView> views;
  std::optional<Trainer> trainer;

  explicit Scene(const TrainOptions& options, Dataset data, bool with_depth = true) {
    if (with_depth) data.depth = test::toy_depth(data);
    field.create(options, data.modality, static_cast<int>(data.views.size()));
    field.space = estimate_space(data);
    field.span = estimate_span(data);
    field.options.haze_samples = 8;
    views = prepare_views(data, field.space, field.span);
    const std::vector<bool> heldout(views.size(), false);
    if (with_depth) carve(true, views, heldout, options, field.occupancy);
    for (std::size_t i = 0; options.refine_poses && i < views.size(); ++i)
      field.refined_poses.push_back(unmoved(data.views[i].cam_from_world));
    trainer.emplace(field, views, heldout, kernels_for(Isa::avx2));  // in float, as a device
  }
  bool run(int from, int to, int of) {
    bool finite = true;
    for (int i = from; i < to; ++i) finite = trainer->step(i / double(of)) && finite;
    trainer->settle();
    return finite;
  }
};

TrainOptions small_options(Modality modality, int iterations) {
  TrainOptions options = test::toy_options(modality, iterations);
  options.samples_per_step = 2048;
  options.hidden = options.color_hidden = 32;
  return options;
}

double largest(const std::vector<float>& values) {
  double out = 0;
  for (const float v : values) out = std::max(out, std::abs(double{v}));
  return out;
}

void expect_near(const std::vector<float>& a, const std::vector<float>& b, double tolerance,
                 const char* what) {
  ASSERT_EQ(a.size(), b.size()) << what;
  const double scale = largest(b);
  EXPECT_GT(scale, 0) << what;
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(double{a[i]} - b[i]));
  EXPECT_LT(worst, tolerance * scale) << what;
}

// After the first step Adam's first moments are a tenth of the gradients.
TEST_P(DeviceTest, OneStepHasTheProcessorsGradients) {
  for (const Modality modality : {Modality::visible, Modality::thermal})
    for (const bool with_depth : {true, false}) {
      SCOPED_TRACE(std::string(name(modality)) + (with_depth ? ", depth" : ""));
      TrainOptions options = small_options(modality, 100);
      options.sh_degree = 3;
      options.color_layers = with_depth ? 2 : 1;
      options.features_per_level = with_depth ? 4 : 2;
      options.level_anneal_end = with_depth ? 0 : 0.5;
      Dataset data = test::toy_scene(modality, 6);
      if (!with_depth) {  // a lens that bends, and a few points of SfM
        for (TrainingView& view : data.views) view.camera.k1 = -0.1;
        for (int i = 0; i < 60; ++i) {
          SparsePoint point;
          point.position = {0.4 * std::cos(0.1 * i), 0.4 * std::sin(0.1 * i), 0.01 * (i % 7)};
          for (int view = 0; view < 6; ++view) {
            const TrainingView& seen = data.views[static_cast<std::size_t>(view)];
            const Eigen::Vector3d p =
                seen.cam_from_world.rotation * point.position + seen.cam_from_world.translation;
            point.track.push_back({view, seen.camera.project(p)});
          }
          data.points.push_back(point);
        }
      }
      Scene here(options, data, with_depth);
      const auto used = in_use();
      Scene there(options, data, with_depth);
      ASSERT_TRUE(here.run(10, 11, 100));
      ASSERT_TRUE(there.run(10, 11, 100));
      EXPECT_EQ(here.trainer->rays(), there.trainer->rays());
      EXPECT_NEAR(static_cast<double>(here.trainer->samples()),
                  static_cast<double>(there.trainer->samples()), 2);
      EXPECT_NEAR(here.field.train_psnr, there.field.train_psnr, 1e-3);
      const auto& first = &Parameters::first;
      expect_near(there.field.main.mlp.weights.*first, here.field.main.mlp.weights.*first, 1e-3,
                  "density network");
      expect_near(there.field.color.weights.*first, here.field.color.weights.*first, 1e-3,
                  "colour network");
      expect_near(there.field.main.grid.table.part(&GridLine::first),
                  here.field.main.grid.table.part(&GridLine::first), 5e-3, "table");
      if (modality == Modality::thermal) {
        expect_near(there.field.image_offsets.first, here.field.image_offsets.first, 1e-3,
                    "offsets");
      }
    }
}

TEST_P(DeviceTest, RaysShowWhatTheProcessorSees) {
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    Scene scene(small_options(modality, 120), test::toy_scene(modality, 8));
    ASSERT_TRUE(scene.run(0, 120, 120));
    const ViewRays& rays = scene.views[1].rays;
    const int width = rays.camera().width, count = width * rays.camera().height;
    const auto ray_of = [&](int i, DrawnRay& out) {
      out = {{},
             i % 5 == 0 ? 0.7f : 0.0f,
             i % 7 == 0 ? 1.0f : std::numeric_limits<float>::max(),
             0.5f};
      return i % 11 != 0 && rays.ray(i % width + 0.5, i / width + 0.5, out.ray);
    };
    const float surface_light = modality == Modality::visible ? 0.5f : 0.7f;
    const auto trace = [&] {
      std::vector<TracedRay> out(static_cast<std::size_t>(count));
      trace_rays(scene.field, {1e-3f, 1e-4f, false, surface_light}, scene.field.march_settings(),
                 count, ray_of, out.data());
      return out;
    };
    const auto here = trace();
    const auto used = in_use();
    const auto there = trace();
    int seen = 0, apart = 0;
    for (std::size_t i = 0; i < here.size(); ++i) {
      ASSERT_EQ(here[i].there, there[i].there) << i;
      if (!here[i].there) continue;
      for (int c = 0; c < scene.field.channels(); ++c)
        EXPECT_NEAR(here[i].value[c], there[i].value[c], 0.02) << i;
      EXPECT_NEAR(here[i].opacity, there[i].opacity, 0.02) << i;
      EXPECT_EQ(here[i].forward, there[i].forward) << i;
      // Near a threshold rounding decides: where the surface's light is left, or none.
      const auto differ = [](float a, float b) { return !(a == b || std::abs(a - b) < 0.02); };
      const bool both_nan = std::isnan(here[i].distance) && std::isnan(there[i].distance);
      apart += (!both_nan && differ(here[i].distance, there[i].distance)) ||
               differ(here[i].end, there[i].end) || differ(here[i].begin, there[i].begin) ||
               here[i].starts_dark != there[i].starts_dark;
      seen += here[i].opacity > 0.5f;
    }
    EXPECT_GT(seen, count / 8);
    EXPECT_LT(apart, count / 50);
  }
}

TEST_P(DeviceTest, RaysFromNowhereOrOfNaNShowTheBackground) {
  Scene scene(small_options(Modality::visible, 20), test::toy_scene(Modality::visible, 4));
  ASSERT_TRUE(scene.run(0, 20, 20));
  const float nan = std::nanf(""), inf = std::numeric_limits<float>::infinity();
  const Ray odd[] = {{{nan, 0, 0}, {1, 0, 0}, 1},  {{0, 0, 0}, {nan, nan, nan}, 1},
                     {{inf, 0, 0}, {-1, 0, 0}, 1}, {{1e30f, 0, 0}, {1, 0, 0}, 1},
                     {{0, 0, 0}, {0, 0, 0}, 1},    {{40, 0, 0}, {-1, 0, 0}, 1}};
  const auto used = in_use();
  std::vector<TracedRay> out(std::size(odd));
  trace_rays(
      scene.field, {1e-3f, 1e-4f, false}, scene.field.march_settings(),
      static_cast<int>(std::size(odd)),
      [&](int i, DrawnRay& ray) {
        ray = {odd[i], 0, std::numeric_limits<float>::max(), 0.5f};
        return true;
      },
      out.data());
  for (const TracedRay& ray : out) EXPECT_TRUE(ray.there);
  EXPECT_EQ(out[0].opacity, 0);
  EXPECT_EQ(out[3].opacity, 0) << "looks away from the scene";
  trace_rays(
      scene.field, {1e-3f, 1e-4f, false}, scene.field.march_settings(), 0,
      [](int, DrawnRay&) { return false; }, nullptr);
}

TEST_P(DeviceTest, NothingMovesWhereAGradientIsNotFinite) {
  Dataset data = test::toy_scene(Modality::visible, 4);
  const auto used = in_use();
  Scene scene(small_options(Modality::visible, 20), data);
  ASSERT_TRUE(scene.run(0, 3, 20));
  const std::vector<float> before = scene.field.main.grid.table.values(),
                           network = scene.field.color.weights.value,
                           window = scene.field.occupancy.window;
  // An infinite target that begins with a finite channel.
  for (NormalisedView& view : scene.views)
    for (int y = 0; y < view.target.rows; ++y)
      for (int x = 0; x < view.target.cols; ++x)
        view.target.at<cv::Vec3f>(y, x)[2] = std::numeric_limits<float>::infinity();
  const std::vector<bool> heldout(scene.views.size(), false);
  scene.trainer.emplace(scene.field, scene.views, heldout);
  EXPECT_FALSE(scene.trainer->step(0.2));
  scene.trainer->settle();
  EXPECT_EQ(scene.field.main.grid.table.values(), before);
  EXPECT_EQ(scene.field.color.weights.value, network);
  EXPECT_EQ(scene.field.occupancy.window, window);
}

// Long ways through cells that all hold something: as many stretches as a ray can have.
TEST_P(DeviceTest, RaysFromAnywhereCrossFullCellsAsTheProcessors) {
  Scene scene(small_options(Modality::visible, 20), test::toy_scene(Modality::visible, 4));
  ASSERT_TRUE(scene.run(0, 20, 20));
  Occupancy& cells = scene.field.occupancy;
  for (std::size_t i = 0; i < cells.density.size(); ++i)
    cells.density[i] = 0.1f + 3 * random_uniform(4, 3, i);
  cells.on.assign(cells.on.size(), ~std::uint64_t{0});
  cells.refresh();
  scene.field.refresh();
  constexpr int count = 400;
  const auto ray_of = [](int i, DrawnRay& out) {
    const auto u = [i](std::uint64_t part) {
      return 2 * random_uniform(5, part, static_cast<unsigned>(i)) - 1;
    };
    const float away = i % 3 == 0 ? 0.5f : i % 3 == 1 ? 4.0f : 60.0f;
    float length = 0;
    for (unsigned d = 0; d < 3; ++d) {
      out.ray.origin[d] = away * u(d);
      out.ray.direction[d] = 0.3f * u(3 + d) - out.ray.origin[d];
      length += out.ray.direction[d] * out.ray.direction[d];
    }
    for (float& d : out.ray.direction) d /= std::sqrt(length);
    out.ray.forward = 1;
    out.near = 0;
    out.far = std::numeric_limits<float>::max();
    out.jitter = 0.5f;
    return true;
  };
  const auto trace = [&] {
    std::vector<TracedRay> out(count);
    trace_rays(scene.field, {1e-3f, 1e-4f, false}, {.near = 0.1f, .surface = 100, .haze = 100},
               count, ray_of, out.data());
    return out;
  };
  const auto here = trace();
  const auto used = in_use();
  const auto there = trace();
  double worst = 0;
  for (int i = 0; i < count; ++i)
    for (int c = 0; c < 3; ++c)
      worst = std::max(worst, std::abs(double{here[static_cast<std::size_t>(i)].value[c]} -
                                       there[static_cast<std::size_t>(i)].value[c]));
  EXPECT_LT(worst, 0.01);
}

INSTANTIATE_TEST_SUITE_P(Every, DeviceTest, ::testing::Values("emulated", "cuda"),
                         [](const auto& instance) { return std::string(instance.param); });

TEST(Device, ABuildOrMachineWithoutOneSaysSo) {
  try {
    EXPECT_FALSE(device::cuda_engine()->name().empty());
  } catch (const device::Refused& refused) {
    EXPECT_FALSE(refused.what.empty());
    EXPECT_EQ(device::error_of(refused).kind, ErrorKind::unavailable);
  }
}

}  // namespace
}  // namespace orbitfuse::nerf
