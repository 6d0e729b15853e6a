// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "core/numeric/random.hpp"
#include "core/system/parallel.hpp"
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

/// A place near a drawn occupied cell, where it lies in one that is not.
std::optional<std::array<float, 3>> Trainer::beside_occupied(std::uint64_t draw) const {
  const Occupancy& grid = field_.occupancy;
  const std::uint64_t bits = random_bits(
      field_.options.seed, probe_stream,
      static_cast<std::uint64_t>(field_.step) * occupancy_probes * probe_attempts + draw);
  const auto cells = static_cast<std::uint64_t>(grid.cell_count());
  const auto cell = static_cast<std::int64_t>(bits % cells);
  if (!Occupancy::test(grid.on, cell)) return std::nullopt;
  std::array<float, 3> x{};
  grid.center_of(cell, x.data());
  const int cascade = static_cast<int>(cell / (grid.cell_count() / grid.cascades));
  for (unsigned d = 0; d < 3; ++d)
    x[d] += grid.cell_size(cascade) * 3.0f * (uniform01(random_bits(bits, 7, d)) - 0.5f);
  const int at = Occupancy::cascade_of(x.data());
  if (at >= grid.cascades || Occupancy::test(grid.on, grid.cell_of(at, x.data())))
    return std::nullopt;
  return x;
}

/// Brings cells back: neighbours of occupied cells whose density is above the threshold.
void Trainer::probe_cells() {
  // Places count in the order of their draws, whatever the number of threads.
  constexpr std::size_t per_block = 512, round = 16 * per_block,
                        draws = std::size_t{occupancy_probes} * probe_attempts;
  static_assert(draws % round == 0);
  std::vector<float> position;
  for (std::size_t first = 0; first < draws && position.size() < 3 * occupancy_probes;
       first += round) {
    std::array<std::vector<float>, round / per_block> found;
    parallel_for(static_cast<int>(found.size()), [&](int index) {
      const auto block = static_cast<std::size_t>(index);
      for (std::size_t k = 0; k < per_block; ++k)
        if (const auto x = beside_occupied(first + block * per_block + k))
          found[block].insert(found[block].end(), x->begin(), x->end());
    });
    for (const std::vector<float>& block : found)
      position.insert(position.end(), block.begin(), block.end());
  }
  position.resize(std::min<std::size_t>(position.size(), 3 * occupancy_probes));
  const int count = static_cast<int>(position.size() / 3);
  std::vector<float> sigma(static_cast<std::size_t>(count));
  parallel_blocks(count, static_cast<int>(per_block), [&](int begin, int end) {
    densities(field_.main, kernels_, &position[static_cast<std::size_t>(3 * begin)], end - begin,
              &sigma[static_cast<std::size_t>(begin)]);
  });
  for (int i = 0; i < count; ++i)
    field_.occupancy.record(&position[static_cast<std::size_t>(3 * i)],
                            sigma[static_cast<std::size_t>(i)]);
}

}  // namespace orbitfuse::nerf
