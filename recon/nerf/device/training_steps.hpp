// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/nerf/device/field_store.hpp"

// A training step on a device: what Trainer::step() does with blocks and shards.
namespace orbitfuse::nerf::ORBITFUSE_ENGINE {

/// All photos in one array a kind.
class PhotoStore {
 public:
  PhotoStore(const std::vector<device::Photo>& photos, const PixelTilesView& tiles, int channels,
             std::size_t offsets)
      : channels_(channels), tile_count_(tiles.count) {
    std::vector<float> target, distance, lattice;
    std::vector<std::int32_t> known;
    std::vector<std::uint8_t> clearance;
    std::vector<int> training;
    std::vector<long long> known_ends;
    long long pixels = 0, known_pixels = 0;
    for (const device::Photo& photo : photos) {
      const long count = static_cast<long>(photo.rays.width) * photo.rays.height;
      TrainingPhoto view{photo.rays, static_cast<long>(lattice.size()),
                         static_cast<long>(distance.size()), static_cast<long>(known.size()), -1};
      if (photo.trains) {
        training.push_back(static_cast<int>(views_.size()));
        pixels += count;
        known_ends.push_back(known_pixels += photo.known_count);
        const long nodes = static_cast<long>(photo.rays.lattice_columns) * photo.rays.lattice_rows;
        lattice.insert(lattice.end(), photo.lattice, photo.lattice + 2 * nodes);
        target.insert(target.end(), photo.target, photo.target + channels * count);
        distance.insert(distance.end(), photo.distance, photo.distance + count);
        known.insert(known.end(), photo.known, photo.known + photo.known_count);
        if (photo.clearance_px != nullptr) {
          view.clearance = static_cast<long>(clearance.size());
          clearance.insert(clearance.end(), photo.clearance_px, photo.clearance_px + count);
        }
      }
      views_.push_back(view);
    }
    sparse = points_are_sparse(known_pixels, pixels);
    training_count = static_cast<int>(training.size());
    target_.upload(target);
    distance_.upload(distance);
    lattice_.upload(lattice);
    known_.upload(known);
    clearance_.upload(clearance);
    training_.upload(training);
    std::vector<int> trains(offsets);
    for (const int view : training) trains[static_cast<std::size_t>(view)] = 1;
    trains_.upload(trains);
    tiles_.upload({tiles.tiles, tiles.tiles + tiles.count});
    tile_ends_.upload({tiles.ends, tiles.ends + tiles.count});
    known_ends_.upload(known_ends);
    view_.upload(views_);
  }

  void place(int view, const RayNumbers& rays) {
    views_[static_cast<std::size_t>(view)].rays = rays;
    placed_ = false;
  }
  Photos photos() {
    if (!placed_) view_.upload(views_);
    placed_ = true;
    return {view_.data(),  lattice_.data(),   target_.data(), distance_.data(),
            known_.data(), clearance_.data(), channels_};
  }
  int count() const { return static_cast<int>(views_.size()); }
  const int* trains() const { return trains_.data(); }  ///< [view, padded as the offsets]
  DrawRays draw(const device::StepPlan& plan, DeviceRay* rays) {
    return {photos(),
            training_.data(),
            known_ends_.data(),
            training_count,
            plan.seed,
            plan.step,
            plan.first_ray,
            {tiles_.data(), tile_ends_.data(), tile_count_},
            sparse,
            plan.supervision,
            rays};
  }

  int training_count = 0;
  bool sparse = false;  ///< known distances are few

 private:
  int channels_, tile_count_;
  std::vector<TrainingPhoto> views_;
  bool placed_ = true;
  Buffer<TrainingPhoto> view_;
  Buffer<float> target_, distance_, lattice_;
  Buffer<std::int32_t> known_;
  Buffer<std::uint8_t> clearance_;
  Buffer<int> training_, trains_;
  Buffer<long long> known_ends_;
  Buffer<PixelTile> tiles_;
  Buffer<std::uint64_t> tile_ends_;
};

class TrainingSteps final : public device::Steps {
 public:
  TrainingSteps(const device::FieldNumbers& field, const std::vector<device::Photo>& photos,
                const PixelTilesView& tiles)
      : field_(field), photos_(photos, tiles, field.channels, field.offsets.value.size()) {
    table_.upload(field.table);
    offsets_.upload(field.offsets);
    allowed_.upload(field.allowed);
    cell_density_.upload(field.cell_density);
    window_.upload(field.window);
    table_gradient_.zeros(table_.count);
    offset_gradient_.zeros(offsets_.count);
    pose_sums_.zeros(static_cast<std::size_t>(photos_.count() * pose_numbers));
    density_gradient_.need(field_.density.numbers.count);
    color_gradient_.need(field_.color.numbers.count);
    std::size_t widest = 0;
    for (const NetworkStore* network : {&field_.density, &field_.color})
      for (int l = 0; l < network->layers.count; ++l) {
        const DenseLayer& layer = network->layers.layer[l];
        const auto weights =
            static_cast<std::size_t>(layer.inputs) * static_cast<std::size_t>(layer.outputs);
        widest = weights > widest ? weights : widest;
      }
    partial_.need(widest * weight_chunks);
    state_.need(1);
    visits_.need(1);
    offset_sum_.need(1);
    code_least_.upload(code_thresholds().least, 256);
  }

  device::StepOutcome step(const device::StepPlan& plan) override {
    StepState fresh{};
    fresh.finite = 1;
    state_.upload(&fresh, 1);
    pass_.rays.need(static_cast<std::size_t>(plan.rays));
    launch(plan.rays, photos_.draw(plan, pass_.rays.data()));
    pass_.run(field_, plan.rays, plan.march, training_stop, training_min_weight);
    backward(plan);
    if (plan.posing)
      launch(plan.rays, WatchPoses{photos_.photos(), pass_.shown(field_), offsets_.value.data(),
                                   pose_sums_.data()});
    move(plan);
    launch(plan.rays, RecordRays{pass_.rays.data(), pass_.samples, pass_.light, cells(),
                                 &state_.data()->finite});
    const StepState state = state_.download(1).front();
    return {static_cast<long>(state.sums.rays), static_cast<long>(state.sums.samples),
            static_cast<long>(state.sums.channels),
            static_cast<double>(state.sums.squared_error) * error_unit, state.finite != 0};
  }

  void set_level_weight(const std::vector<float>& weight) override {
    for (std::size_t l = 0; l < weight.size(); ++l) field_.levels.weight[l] = weight[l];
  }

  void update_occupancy(int step, std::uint64_t seed, float decay, float threshold) override {
    probe(step, seed);
    const VisitSums none{};
    visits_.upload(&none, 1);
    launch(cell_count(), FadeCells{cells(), decay, visits_.data()});
    launch(cell_count() / 64, SwitchCells{cells(), threshold, visits_.data()});
  }

  std::vector<PoseSums> take_pose_sums() override {
    const auto count = static_cast<std::size_t>(photos_.count());
    const std::vector<long long> sums = pose_sums_.download(count * pose_numbers);
    pose_sums_.zeros(count * pose_numbers);
    std::vector<PoseSums> out(count);
    for (std::size_t view = 0; view < count; ++view) {
      const long long* from = &sums[view * pose_numbers];
      for (std::size_t a = 0; a < 6; ++a)
        for (std::size_t b = a; b < 6; ++b)
          out[view].normal[6 * a + b] = out[view].normal[6 * b + a] =
              static_cast<double>(*from++) * pose_unit;
      for (double& r : out[view].right) r = static_cast<double>(*from++) * pose_unit;
      out[view].rays = *from;
    }
    return out;
  }

  void place(int view, const RayNumbers& rays) override { photos_.place(view, rays); }

  device::FieldNumbers fetch() override {
    device::FieldNumbers out;
    table_.download(out.table);
    field_.density.numbers.download(out.density.weights);
    field_.color.numbers.download(out.color.weights);
    offsets_.download(out.offsets);
    const auto count = static_cast<std::size_t>(cell_count());
    out.on = field_.on.download(count / 64);
    out.cell_density = cell_density_.download(count);
    out.window = window_.download(count);
    return out;
  }

 private:
  int cell_count() const {
    return field_.resolution * field_.resolution * field_.resolution * field_.cascades;
  }
  CellStore cells() const {
    return {field_.resolution,   field_.cascades,   field_.on.data(),     field_.any.data(),
            field_.plain.data(), allowed_.data(),   cell_density_.data(), window_.data(),
            field_.look.data(),  code_least_.data()};
  }

  void backward(const device::StepPlan& plan) {
    const std::size_t stride = static_cast<std::size_t>(pass_.stride);
    along_.need(2 * stride);
    dcolor_.need(color_outputs * stride);
    // Only the channels that are used are written.
    fill_bytes(dcolor_.data(), 0, color_outputs * stride * sizeof(float));
    ddensity_.need(density_outputs * stride);
    const Rows dcolor{dcolor_.data(), pass_.stride}, ddensity{ddensity_.data(), pass_.stride};
    float *dweight = along_.data(), *dsigma = dweight + stride;
    launch(plan.rays, RayLoss{pass_.shown(field_),
                              {plan.per_ray, plan.distortion_weight, plan.huber},
                              offsets_.value.data(),
                              dweight,
                              dsigma,
                              dcolor,
                              offset_gradient_.data(),
                              state_.data()});
    const Rows dcolor_in = network_backward(field_.color, pass_.color, pass_.color_in, dcolor,
                                            pass_.row_count, color_gradient_);
    launch(pass_.sample_count.bound,
           DensityGradient{pass_.sample_count, dsigma, pass_.light.sigma, ddensity});
    launch(pass_.row_count.bound,
           AddColorGradient{pass_.row_count, pass_.sample_of.data(), dcolor_in, ddensity});
    const Rows dfeatures = network_backward(field_.density, pass_.density, pass_.features, ddensity,
                                            pass_.sample_count, density_gradient_);
    scatter(dfeatures);
  }

  /// Weight gradients of a network; returns its inputs' gradient.
  Rows network_backward(const NetworkStore& network, const Activations& a, Rows in, Rows dout,
                        SampleCount samples, Buffer<float>& gradient) {
    const Layers& layers = network.layers;
    Rows d = dout;
    for (int l = layers.count - 1; l >= 0; --l) {
      const DenseLayer& layer = layers.layer[l];
      const Rows input = l > 0 ? a.rows[l - 1] : in;
      const int weights = layer.inputs * layer.outputs;
      launch(
          WeightGradient::threads(layer.inputs, layer.outputs),
          WeightGradient{layer.inputs, layer.outputs, input, d, samples.counted, partial_.data()});
      launch(weights, SumChunks{weights, partial_.data(), gradient.data() + layer.offset,
                                &state_.data()->finite});
      Buffer<float>& memory = dlayer_[l % 2];
      memory.need(static_cast<std::size_t>(layer.inputs * pass_.stride));
      const Rows din{memory.data(), pass_.stride};
      launch(ApplyLayer::threads(layer.inputs, samples.bound),
             ApplyLayer{layer.outputs, layer.inputs, network.turned(l), d, din, samples,
                        l > 0 ? Epilogue::mask : Epilogue::store, input});
      d = din;
    }
    return d;
  }

  void scatter(Rows dfeatures) {
    const int count = field_.levels.count * pass_.sample_count.bound;
    int* finite = &state_.data()->finite;
    if (field_.levels.features == 4)
      launch(count, Scatter<4>{field_.levels, pass_.samples.position01, pass_.sample_count,
                               dfeatures, table_gradient_.data(), finite});
    else
      launch(count, Scatter<2>{field_.levels, pass_.samples.position01, pass_.sample_count,
                               dfeatures, table_gradient_.data(), finite});
  }

  void move(const device::StepPlan& plan) {
    const int* finite = &state_.data()->finite;
    launch(
        static_cast<int>(table_.count),
        AdamTable{plan.grid, table_.moments(), table_gradient_.data(), field_.half.data(), finite});
    const auto network = [&](NetworkStore& of, const Buffer<float>& gradient) {
      launch(static_cast<int>(of.numbers.count),
             AdamNetwork{plan.network, of.layers, of.numbers.moments(), gradient.data(),
                         of.transposed.data(), finite});
    };
    network(field_.density, density_gradient_);
    network(field_.color, color_gradient_);
    if (!plan.with_offsets) return;
    const int views = static_cast<int>(offsets_.count);
    fill_bytes(offset_sum_.data(), 0, sizeof(long long));
    launch(views, AdamOffsets{plan.offsets, offsets_.moments(), offset_gradient_.data(),
                              photos_.trains(), offset_sum_.data(), finite});
    launch(views, CenterOffsets{offsets_.moments(), photos_.trains(), offset_sum_.data(),
                                photos_.training_count, finite});
  }

  void probe(int step, std::uint64_t seed) {
    constexpr int draws = occupancy_probes * probe_attempts;
    drawn_.need(draws);
    there_.need(draws + 1);
    before_.need(draws + 1);
    chosen_.need(occupancy_probes);
    probe_position_.need(3 * occupancy_probes);
    probe_features_.zeros(static_cast<std::size_t>(field_.width) * occupancy_probes);
    probe_activations_.need(field_.density.layers, occupancy_probes);
    probe_count_.need(1);
    launch(draws, DrawProbes{cells(), seed, step, drawn_.data(), there_.data()});
    scan_.run(there_.data(), draws, before_.data());
    const Rows position{probe_position_.data(), occupancy_probes},
        features{probe_features_.data(), occupancy_probes};
    launch(draws, ListProbes{drawn_.data(), there_.data(), before_.data(), chosen_.data(), position,
                             probe_count_.data()});
    const SampleCount count{probe_count_.data(), occupancy_probes};
    encode(field_, position, count, features);
    apply(field_.density, features, count, probe_activations_);
    launch(occupancy_probes, RecordProbes{chosen_.data(), count.counted,
                                          probe_activations_.out(field_.density.layers), cells()});
  }

  FieldStore field_;
  PhotoStore photos_;
  ForwardPass pass_;
  NumberStore table_, offsets_;
  Buffer<std::uint64_t> allowed_;
  Buffer<float> cell_density_, window_, code_least_;
  Buffer<long long> table_gradient_, offset_gradient_, offset_sum_, pose_sums_;
  Buffer<float> density_gradient_, color_gradient_, partial_;
  Buffer<float> along_, dcolor_, ddensity_, dlayer_[2];
  Buffer<StepState> state_;
  Buffer<VisitSums> visits_;
  Scan scan_;
  Buffer<Four> drawn_, chosen_;
  Buffer<int> there_, before_, probe_count_;
  Buffer<float> probe_position_, probe_features_;
  Activations probe_activations_;
};

}  // namespace orbitfuse::nerf::ORBITFUSE_ENGINE
