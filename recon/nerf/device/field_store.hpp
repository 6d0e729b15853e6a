// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/nerf/device/adam.hpp"
#include "recon/nerf/device/engine.hpp"
#include "recon/nerf/device/grid.hpp"
#include "recon/nerf/device/layers.hpp"
#include "recon/nerf/device/loss.hpp"
#include "recon/nerf/device/occupancy.hpp"

// A field in a device's memory, and what its rays show there.
namespace orbitfuse::nerf::ORBITFUSE_ENGINE {

/// Parameters of a set with what Adam keeps of them.
struct NumberStore {
  Buffer<float> value, first, second;
  std::size_t count = 0;

  void upload(const device::Numbers& from) {
    count = from.value.size();
    value.upload(from.value);
    first.upload(from.first);
    second.upload(from.second);
  }
  void download(device::Numbers& to) const {
    to.value = value.download(count);
    to.first = first.download(count);
    to.second = second.download(count);
  }
  Moments moments() const { return {value.data(), first.data(), second.data()}; }
};

struct NetworkStore {
  NumberStore numbers;
  Buffer<float> transposed;
  Layers layers;

  void upload(const device::NetworkNumbers& from) {
    numbers.upload(from.weights);
    transposed.upload(from.transposed);
    layers.count = 0;
    for (const DenseLayer& layer : from.layers) layers.layer[layers.count++] = layer;
  }
  const float* weights(int layer) const {
    return numbers.value.data() + layers.layer[layer].offset;
  }
  const float* turned(int layer) const { return transposed.data() + layers.layer[layer].offset; }
};

struct FieldStore {
  Levels levels;
  int width;
  Shade shade;
  int sh_degree;
  Buffer<std::uint16_t> half;
  NetworkStore density, color;
  int resolution, cascades;
  Buffer<std::uint64_t> on, any, plain;
  Buffer<std::uint8_t> look;

  explicit FieldStore(const device::FieldNumbers& from)
      : width(from.width),
        shade{from.channels, from.bounded},
        sh_degree(from.sh_degree),
        resolution(from.resolution),
        cascades(from.cascades) {
    levels.count = static_cast<int>(from.levels.size());
    levels.features = from.features;
    for (std::size_t l = 0; l < from.levels.size(); ++l) {
      levels.level[l] = from.levels[l];
      levels.weight[l] = from.level_weight[l];
    }
    half.upload(from.half);
    density.upload(from.density);
    color.upload(from.color);
    on.upload(from.on);
    any.upload(from.any);
    plain.upload(from.plain);
    look.upload(from.look);
  }

  Cells cells() const { return {resolution, cascades, look.data(), any.data(), plain.data()}; }
};

/// A perceptron's outputs and, if they are asked for, its hidden layers' too.
struct Activations {
  Buffer<float> memory[most_layers];
  Rows rows[most_layers];

  void need(const Layers& layers, long stride) {
    for (int l = 0; l < layers.count; ++l) {
      memory[l].need(static_cast<std::size_t>(layers.layer[l].outputs * stride));
      rows[l] = {memory[l].data(), stride};
    }
  }
  Rows out(const Layers& layers) const { return rows[layers.count - 1]; }
};

inline void apply(const NetworkStore& network, Rows in, SampleCount samples, Activations& a) {
  const Layers& layers = network.layers;
  for (int l = 0; l < layers.count; ++l) {
    const DenseLayer& layer = layers.layer[l];
    const Epilogue epilogue = l + 1 < layers.count ? Epilogue::relu : Epilogue::store;
    launch(ApplyLayer::threads(layer.outputs, samples.bound), ApplyLayer{layer.inputs,
                                                                         layer.outputs,
                                                                         network.weights(l),
                                                                         l > 0 ? a.rows[l - 1] : in,
                                                                         a.rows[l],
                                                                         samples,
                                                                         epilogue,
                                                                         {}});
  }
}

inline void encode(const FieldStore& field, Rows position01, SampleCount samples, Rows features) {
  const int count = field.levels.count * samples.bound;
  if (field.levels.features == 4)
    launch(count, Encode<4>{field.levels, field.half.data(), position01, samples, features});
  else
    launch(count, Encode<2>{field.levels, field.half.data(), position01, samples, features});
}

/// From rays to what they show. Sizes are bounds: how many samples there are, only the device
/// knows.
class ForwardPass {
 public:
  Buffer<DeviceRay> rays;
  RaySamples samples;
  SampleCount sample_count, row_count;  ///< rows: samples with a colour
  Rows features, color_in;
  Activations density, color;
  Light light;
  Buffer<int> first_row, sample_of, ray_of;
  long stride = 0;  ///< of samples and rows

  /// What `rays` show, `count` of them.
  void run(const FieldStore& field, int count, const MarchSettings& settings, float stop,
           float min_weight) {
    place(field, count, settings);
    encode(field, samples.position01, sample_count, features);
    apply(field.density, features, sample_count, density);
    const Rows densities = density.out(field.density.layers);
    launch(count, Composite{rays.data(), samples, densities, stop, min_weight, light});
    scan_.run(light.colored, count, first_row.data());
    row_count = {first_row.data() + count, sample_count.bound};
    launch(count, ListColored{rays.data(), samples, light, min_weight, first_row.data(),
                              sample_of.data(), ray_of.data()});
    launch(row_count.bound, ColorInput{rays.data(), densities, sample_of.data(), ray_of.data(),
                                       row_count.counted, field.sh_degree, color_in});
    apply(field.color, color_in, row_count, color);
  }
  ShownRays shown(const FieldStore& field) const {
    return {rays.data(), samples,          light,           color.out(field.color.layers),
            field.shade, first_row.data(), sample_of.data()};
  }

 private:
  void place(const FieldStore& field, int count, const MarchSettings& settings) {
    const int most_haze = settings.haze > 2 ? settings.haze : 2;
    const int wanted = settings.surface + most_haze;
    const int per_ray = 1 + (wanted < max_ray_samples ? wanted : max_ray_samples);
    const auto n = static_cast<std::size_t>(count);
    const int slots = field.resolution;  // as piece_begin() says
    segments_.need(n * static_cast<std::size_t>(ray_pieces * slots));
    piece_counts_.need(n * ray_pieces);
    piece_sums_.need(n * ray_pieces);
    need(field, n, n * static_cast<std::size_t>(per_ray));
    sample_count = {first_.data() + count, count * per_ray};
    const Stretches found{count, slots, segments_.data(), piece_counts_.data(), piece_sums_.data()};
    launch(count * ray_pieces, WalkPieces{field.cells(), settings, rays.data(), found});
    launch(count, CountSamples{settings, rays.data(), found, spread_.data(), counts_.data()});
    scan_.run(counts_.data(), count, first_.data());
    launch(count * ray_pieces,
           PlaceSamples{rays.data(), found, spread_.data(), samples, before_end_.data()});
    launch(count * per_ray,
           FinishSamples{rays.data(), spread_.data(), before_end_.data(), per_ray, samples});
  }

  void need(const FieldStore& field, std::size_t count, std::size_t bound) {
    spread_.need(count);
    counts_.need(count + 1);
    first_.need(count + 1);
    first_row.need(count + 1);
    used_.need(count);
    colored_.need(count + 1);
    if (bound > static_cast<std::size_t>(stride)) {
      const std::size_t wide = (bound + bound / 4 + 31) / 32 * 32;
      along_.need(7 * wide);
      position_.need(3 * wide);
      before_end_.need(wide);
      sample_of.need(wide);
      ray_of.need(wide);
      features_.zeros(static_cast<std::size_t>(field.width) * wide);  // padding stays 0
      color_in_.need(color_inputs * wide);
      density.need(field.density.layers, static_cast<long>(wide));
      color.need(field.color.layers, static_cast<long>(wide));
      stride = static_cast<long>(wide);  // last: whatever was refused is asked for again
    }
    float* along = along_.data();
    const auto part = [&](int i) { return along + i * stride; };
    samples = {first_.data(), part(0), part(1), part(2), part(3), {position_.data(), stride}};
    light = {part(4), part(5), part(6), used_.data(), colored_.data()};
    features = {features_.data(), stride};
    color_in = {color_in_.data(), stride};
  }

  Scan scan_;
  Buffer<Segment> segments_;
  Buffer<PieceSum> piece_sums_;
  Buffer<int> piece_counts_;
  Buffer<SampleSpread> spread_;
  Buffer<int> counts_, first_, used_, colored_;
  Buffer<float> along_, position_, before_end_, features_, color_in_;
};

}  // namespace orbitfuse::nerf::ORBITFUSE_ENGINE
