// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/rendering/proposal.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "recon/nerf/kernels/compositing.hpp"
#include "recon/nerf/kernels/interlevel.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr float histogram_padding = 0.01f;  // as in nerfacto

/// Even edges in spaced distance; all inner ones move with the jitter.
void even_edges(int bins, float jitter, float* out) {
  for (int i = 0; i <= bins; ++i) {
    const float low = i > 0 ? static_cast<float>(i) - 0.5f : 0.0f;
    const float high = i < bins ? static_cast<float>(i) + 0.5f : static_cast<float>(bins);
    out[i] = (low + jitter * (high - low)) / static_cast<float>(bins);
  }
}

/// Densities and weights of a level whose edges are set.
void evaluate(const DensityNetwork& network, const Kernels& kernels,
              const std::vector<DrawnRay>& rays, ProposalBlock::Level& level) {
  const auto bins = static_cast<std::size_t>(level.bins);
  const std::size_t count = rays.size() * bins;
  level.dt.resize(count);
  level.position01.resize(3 * count);
  for (std::size_t r = 0; r < rays.size(); ++r)
    for (std::size_t i = 0; i < bins; ++i) {
      const float* edge = &level.edge[r * (bins + 1) + i];
      const float t = 0.5f * (edge[0] + edge[1]);
      float x[3];
      for (int d = 0; d < 3; ++d) x[d] = rays[r].ray.origin[d] + t * rays[r].ray.direction[d];
      contract01(x, &level.position01[3 * (r * bins + i)]);
      level.dt[r * bins + i] = edge[1] - edge[0];
    }
  level.features.resize(count * static_cast<std::size_t>(network.grid.width));
  network.grid.encode(kernels, level.position01.data(), static_cast<int>(count),
                      level.features.data());
  network.mlp.forward(kernels, static_cast<int>(count), level.features.data(), level.density);
  level.sigma.resize(count);
  for (std::size_t i = 0; i < count; ++i)
    level.sigma[i] = density_of(level.density.back()[i * density_outputs]);
  level.weight.assign(count, 0);
  level.light.assign(count, 0);
  for (std::size_t r = 0; r < rays.size(); ++r)
    composite(level.bins, &level.sigma[r * bins], &level.dt[r * bins], 0.0f,
              &level.weight[r * bins], &level.light[r * bins]);
}

void distances_of(const std::vector<float>& spaced, const ProposalSettings& settings,
                  std::vector<float>& out) {
  const float low = spaced_of(settings.near), high = spaced_of(settings.far);
  out.resize(spaced.size());
  for (std::size_t i = 0; i < spaced.size(); ++i)
    out[i] = distance_of(low + spaced[i] * (high - low));
}

/// Edges of the next finer sampling.
void resample_rays(const ProposalBlock::Level& from, const std::vector<DrawnRay>& rays,
                   float anneal, int count, std::vector<float>& out) {
  const auto bins = static_cast<std::size_t>(from.bins);
  std::vector<float> flattened(bins);
  out.resize(rays.size() * static_cast<std::size_t>(count + 1));
  for (std::size_t r = 0; r < rays.size(); ++r) {
    for (std::size_t i = 0; i < bins; ++i) {
      const float w = from.weight[r * bins + i];
      flattened[i] = anneal == 1 ? w : std::pow(w, anneal);
    }
    resample(from.bins, &from.spaced[r * (bins + 1)], flattened.data(), histogram_padding,
             rays[r].jitter, count, &out[r * static_cast<std::size_t>(count + 1)]);
  }
}

}  // namespace

void add_proposed(const FieldState& field, const Kernels& kernels,
                  const std::vector<DrawnRay>& rays, const ProposalSettings& settings,
                  ProposalBlock& proposals, RayBlock& block) {
  auto& [first, second] = proposals.levels;
  first.bins = field.options.proposal_samples_1;
  second.bins = field.options.proposal_samples_2;
  first.spaced.resize(rays.size() * static_cast<std::size_t>(first.bins + 1));
  for (std::size_t r = 0; r < rays.size(); ++r)
    even_edges(first.bins, rays[r].jitter,
               &first.spaced[r * static_cast<std::size_t>(first.bins + 1)]);
  distances_of(first.spaced, settings, first.edge);
  evaluate(field.proposals[0], kernels, rays, first);
  resample_rays(first, rays, settings.anneal, second.bins, second.spaced);
  distances_of(second.spaced, settings, second.edge);
  evaluate(field.proposals[1], kernels, rays, second);

  const int fine = field.options.fine_samples;
  std::vector<float> spaced;
  resample_rays(second, rays, settings.anneal, fine, spaced);
  distances_of(spaced, settings, proposals.fine_edge);
  std::vector<float> t(static_cast<std::size_t>(fine)), dt(static_cast<std::size_t>(fine));
  for (std::size_t r = 0; r < rays.size(); ++r) {
    const float* edge = &proposals.fine_edge[r * static_cast<std::size_t>(fine + 1)];
    for (int i = 0; i < fine; ++i) {
      t[static_cast<std::size_t>(i)] = 0.5f * (edge[i] + edge[i + 1]);
      dt[static_cast<std::size_t>(i)] = edge[i + 1] - edge[i];
    }
    block.add(rays[r].ray, t.data(), dt.data(), fine);
  }
}

double backward_proposals(const FieldState& field, const Kernels& kernels, const RayBlock& block,
                          float per_ray, ProposalBlock& p,
                          std::array<std::vector<float>, 2>& dweights) {
  double loss = 0;
  const std::size_t rays = block.rays.size();
  for (std::size_t k = 0; k < p.levels.size(); ++k) {
    ProposalBlock::Level& level = p.levels[k];
    const DensityNetwork& network = field.proposals[k];
    const auto bins = static_cast<std::size_t>(level.bins);
    const std::size_t count = rays * bins;
    level.dweight.assign(count, 0);
    level.ddensity.assign(count * density_outputs, 0);
    for (std::size_t r = 0; r < rays; ++r) {
      const auto begin = static_cast<std::size_t>(block.first[r]);
      const auto used = static_cast<std::size_t>(block.used[r]);
      p.low.resize(used);
      p.high.resize(used);
      for (std::size_t i = 0; i < used; ++i) {
        p.low[i] = block.t[begin + i] - 0.5f * block.dt[begin + i];
        p.high[i] = block.t[begin + i] + 0.5f * block.dt[begin + i];
      }
      loss += interlevel(block.used[r], p.low.data(), p.high.data(), block.weight.data() + begin,
                         level.bins, &level.edge[r * (bins + 1)], &level.weight[r * bins], per_ray,
                         &level.dweight[r * bins], p.slope);
      p.slope.resize(bins);
      composite_backward(level.bins, &level.dt[r * bins], &level.weight[r * bins],
                         &level.light[r * bins], &level.dweight[r * bins], 0.0f, p.slope.data());
      for (std::size_t i = 0; i < bins; ++i)
        level.ddensity[(r * bins + i) * density_outputs] = p.slope[i] * level.sigma[r * bins + i];
    }
    const auto width = static_cast<std::size_t>(network.grid.width);
    level.dfeatures.resize(count * width);
    network.mlp.backward(kernels, static_cast<int>(count), level.features.data(), level.density,
                         level.ddensity.data(), level.dfeatures.data(), p.scratch_a, p.scratch_b,
                         dweights[k].data());
    if (!all_finite(level.dfeatures.data(), count * width))
      loss = std::numeric_limits<double>::quiet_NaN();
    by_level(network.grid, level.dfeatures, count, level.grid);
  }
  return loss;
}

}  // namespace orbitfuse::nerf
