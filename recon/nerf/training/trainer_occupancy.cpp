// SPDX-License-Identifier: BSD-3-Clause
#include "core/numeric/random.hpp"
#include "recon/nerf/field/draw_rules.hpp"
#include "recon/nerf/training/trainer.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr int occupancy_every = 16;
constexpr int occupancy_warmup = 64;
constexpr float occupancy_decay = 0.95f;

}  // namespace

void Trainer::record_densities() {
  for (const Block& block : blocks_) {
    const RayBlock& b = block.rays;
    for (std::size_t r = 0; r < b.rays.size(); ++r)
      for (int i = b.first[r]; i < b.first[r] + b.used[r]; ++i) {
        const auto k = static_cast<std::size_t>(i);
        const float before = i > b.first[r] ? b.light[k - 1] : 1.0f;
        field_.occupancy.record(&b.position[3 * k], before * b.sigma[k]);
      }
  }
}

void Trainer::update_occupancy(double progress) {
  if (field_.step < occupancy_warmup || field_.step % occupancy_every != 0) return;
  // Relaxed late, so that nothing thin is lost once geometry has settled.
  const auto threshold =
      static_cast<float>(field_.options.occupancy_threshold * (progress < 0.6 ? 1.0 : 0.3));
  if (device_)
    return device_->update_occupancy(field_.step, field_.options.seed, occupancy_decay, threshold);
  probe_cells();
  field_.occupancy.update(occupancy_decay, threshold);
}

/// Brings cells back: neighbours of occupied cells whose density is above the threshold.
void Trainer::probe_cells() {
  Occupancy& grid = field_.occupancy;
  constexpr int probes = occupancy_probes;
  std::vector<float> position, sigma(probes);
  const auto cells = static_cast<std::uint64_t>(grid.cell_count());
  for (int i = 0; i < probes * probe_attempts && static_cast<int>(position.size()) < 3 * probes;
       ++i) {
    const std::uint64_t bits =
        random_bits(field_.options.seed, probe_stream,
                    static_cast<std::uint64_t>(field_.step) * probes * probe_attempts +
                        static_cast<unsigned>(i));
    const auto cell = static_cast<std::int64_t>(bits % cells);
    if (!Occupancy::test(grid.on, cell)) continue;
    float x[3];
    grid.center_of(cell, x);
    const int cascade = static_cast<int>(cell / (grid.cell_count() / grid.cascades));
    for (int d = 0; d < 3; ++d)
      x[d] += grid.cell_size(cascade) * 3.0f *
              (uniform01(random_bits(bits, 7, static_cast<unsigned>(d))) - 0.5f);
    const int at = Occupancy::cascade_of(x);
    if (at >= grid.cascades || Occupancy::test(grid.on, grid.cell_of(at, x))) continue;
    position.insert(position.end(), x, x + 3);
  }
  const int count = static_cast<int>(position.size() / 3);
  densities(field_.main, kernels_, position.data(), count, sigma.data());
  for (int i = 0; i < count; ++i)
    grid.record(&position[static_cast<std::size_t>(3 * i)], sigma[static_cast<std::size_t>(i)]);
}

}  // namespace orbitfuse::nerf
