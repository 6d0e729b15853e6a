// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/field/field_state.hpp"

namespace orbitfuse::nerf {

void FieldState::create(const TrainOptions& with, Modality what, int view_count) {
  options = with;
  modality = what;
  main.grid.create(with.levels, with.features_per_level, with.log2_table, with.base_resolution,
                   with.max_resolution, with.seed);
  main.mlp.create({main.grid.width, with.hidden, density_outputs}, with.seed + 1);
  std::vector<int> widths{color_inputs};
  for (int i = 0; i < with.color_layers; ++i) widths.push_back(with.color_hidden);
  widths.push_back(color_outputs);
  color.create(widths, with.seed + 2);
  proposals.clear();
  if (with.sampling == Sampling::proposal) {
    // As in nerfacto; the finest of the first has 128 cells, of the second 256.
    constexpr int levels = 5, features = 2, log2_entries = 17, coarsest = 16, finest = 128;
    constexpr int inputs = 16, hidden = 16, outputs = 16;
    proposals.resize(2);
    for (unsigned i = 0; i < 2; ++i) {
      proposals[i].grid.create(levels, features, log2_entries, coarsest, finest << i,
                               with.seed + 3 + i);
      proposals[i].mlp.create({inputs, hidden, outputs}, with.seed + 5 + i);
    }
  }
  image_offsets.resize(static_cast<std::size_t>((view_count + 7) / 8 * 8));
  occupancy.create(with.occupancy_resolution, occupancy_cascades);
}

std::vector<DensityNetwork*> FieldState::density_networks() {
  std::vector<DensityNetwork*> all{&main};
  for (DensityNetwork& p : proposals) all.push_back(&p);
  return all;
}

void FieldState::refresh() {
  device_copy.forget();
  for (DensityNetwork* network : density_networks()) {
    network->grid.refresh_half();
    network->mlp.refresh();
  }
  color.refresh();
}

Snapshot FieldState::snapshot(double psnr) {
  Snapshot out;
  out.step = step;
  out.psnr = psnr;
  each_set([&](const auto& set) { out.values.push_back(set.values()); });
  out.occupied = occupancy.on;
  out.codes = occupancy.code;
  for (const DensityNetwork* network : density_networks())
    out.level_weights.push_back(network->grid.level_weight);
  out.poses = refined_poses;
  return out;
}

void FieldState::restore(const Snapshot& from) {
  std::size_t next = 0;
  each_set([&](auto& set) { set.set_values(from.values[next++]); });
  const auto networks = density_networks();
  for (std::size_t i = 0; i < networks.size(); ++i)
    networks[i]->grid.level_weight = from.level_weights[i];
  refined_poses = from.poses;
  occupancy.restore(from.occupied, from.codes);
  refresh();
}

MarchSettings FieldState::march_settings() const {
  MarchSettings settings;
  settings.surface = options.surface_samples;
  settings.haze = options.haze_samples;
  return settings;
}

}  // namespace orbitfuse::nerf
