// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/rendering/proposal.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "core/numeric/random.hpp"
#include "core/system/parallel.hpp"
#include "recon/nerf/kernels/compositing.hpp"
#include "recon/nerf/kernels/interlevel.hpp"
#include "tests/recon/nerf/slope.hpp"
#include "tests/support/toy_scene.hpp"

namespace orbitfuse::nerf {
namespace {

double uniform(std::uint64_t stream, std::uint64_t i) { return random_uniform(77, stream, i); }

TEST(Spacing, IsInvertibleFromNearToFar) {
  for (const double t : {0.0, 1e-3, 0.5, 0.999, 1.0, 3.0, 1e3, 1e6}) {
    EXPECT_NEAR(distance_of(spaced_of(t)), t, 1e-9 * (1 + t * t)) << t;
    EXPECT_LT(spaced_of(t), 1.0);
  }
}

TEST(Resample, PutsEdgesWhereTheMassIs) {
  const double edges[] = {0, 1, 2, 3, 4}, weights[] = {0, 0, 1, 0};
  std::vector<double> out(101);
  resample(4, edges, weights, 1e-6, 0.5, 100, out.data());
  int inside = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    EXPECT_GE(out[i], out[i > 0 ? i - 1 : 0]);
    inside += out[i] >= 2 && out[i] <= 3;
  }
  EXPECT_GE(inside, 99);
}

TEST(Resample, AnyWeightsGiveAscendingEdgesInside) {
  for (const double scale : {0.0, 1e-30, 1.0, 1e30}) {
    for (const double padding : {0.0, 0.01}) {
      std::vector<double> edges(17), weights(16), out(9);
      std::iota(edges.begin(), edges.end(), 0.0);
      for (std::size_t i = 0; i < weights.size(); ++i)
        weights[i] = i % 3 == 0 ? scale * uniform(1, i) : 0.0;
      resample(16, edges.data(), weights.data(), padding, 0.3, 8, out.data());
      for (std::size_t i = 0; i < out.size(); ++i) {
        EXPECT_TRUE(out[i] >= 0 && out[i] <= 16) << scale << ' ' << padding << ' ' << out[i];
        EXPECT_GE(out[i], out[i > 0 ? i - 1 : 0]) << scale << ' ' << padding;
      }
    }
  }
}

/// Random histograms of one ray.
struct Histograms {
  std::vector<double> edges, proposal, low, high, w;
  Histograms() {
    double at = 0.1;
    for (int i = 0; i <= 12; ++i)
      edges.push_back(at += 0.05 + uniform(2, static_cast<unsigned>(i)));
    for (int i = 0; i < 12; ++i) proposal.push_back(0.15 * uniform(3, static_cast<unsigned>(i)));
    at = edges.front() - 0.5;  // reaches beyond the proposal on both sides
    for (int i = 0; i < 20; ++i) {
      low.push_back(at);
      high.push_back(at += 0.1 + 0.7 * uniform(4, static_cast<unsigned>(i)));
      w.push_back(0.1 * uniform(5, static_cast<unsigned>(i)));
    }
  }
  double loss(std::vector<double>& gradient) const {
    std::vector<double> slope;
    gradient.assign(proposal.size(), 0);
    return interlevel(static_cast<int>(w.size()), low.data(), high.data(), w.data(),
                      static_cast<int>(proposal.size()), edges.data(), proposal.data(), 1.0,
                      gradient.data(), slope);
  }
};

TEST(Interlevel, GradientMatchesDifferencesInDouble) {
  Histograms h;
  std::vector<double> gradient, unused;
  EXPECT_GT(h.loss(gradient), 0);
  for (std::size_t j = 0; j < h.proposal.size(); ++j) {
    const double kept = h.proposal[j], step = 1e-6;
    h.proposal[j] = kept + step;
    const double above = h.loss(unused);
    h.proposal[j] = kept - step;
    const double below = h.loss(unused);
    h.proposal[j] = kept;
    EXPECT_NEAR((above - below) / (2 * step), gradient[j], 1e-5 * (1 + std::abs(gradient[j]))) << j;
  }
}

TEST(Interlevel, IsZeroWhereTheProposalCoversAndCountsWhatItMisses) {
  Histograms h;
  std::vector<double> gradient;
  for (double& p : h.proposal) p = 1;
  EXPECT_EQ(h.loss(gradient), 0);
  for (const double g : gradient) EXPECT_EQ(g, 0);
  for (double& p : h.proposal) p = 0;
  EXPECT_NEAR(h.loss(gradient), std::accumulate(h.w.begin(), h.w.end(), 0.0), 1e-4);
}

TrainOptions proposing(Modality modality, int iterations) {
  TrainOptions options = test::toy_options(modality, iterations);
  options.sampling = Sampling::proposal;
  options.proposal_samples_1 = 48;
  options.proposal_samples_2 = 32;
  options.fine_samples = 16;
  options.samples_per_step = 1 << 12;
  return options;
}

/// One level's interlevel loss from its definition, in double after the density; edges stay as they
/// are.
double loss_of(const FieldState& field, const Kernels& kernels, const RayBlock& fine,
               const ProposalBlock& asked, std::size_t k) {
  const ProposalBlock::Level& level = asked.levels[k];
  const auto bins = static_cast<std::size_t>(level.bins);
  double sum = 0;
  for (std::size_t r = 0; r < fine.rays.size(); ++r) {
    const float* edge = &level.edge[r * (bins + 1)];
    std::vector<float> position, sigma(bins);
    for (std::size_t i = 0; i < bins; ++i)
      for (int d = 0; d < 3; ++d)
        position.push_back(fine.rays[r].origin[d] +
                           0.5f * (edge[i] + edge[i + 1]) * fine.rays[r].direction[d]);
    densities(field.proposals[k], kernels, position.data(), level.bins, sigma.data());
    std::vector<double> edges(edge, edge + bins + 1), dt, density(sigma.begin(), sigma.end()),
        w(bins), light(bins);
    for (std::size_t i = 0; i < bins; ++i) dt.push_back(edges[i + 1] - edges[i]);
    composite(level.bins, density.data(), dt.data(), 0.0, w.data(), light.data());
    std::vector<double> low, high, fine_w, unused(bins), scratch;
    for (int i = fine.first[r]; i < fine.first[r] + fine.used[r]; ++i) {
      const auto s = static_cast<std::size_t>(i);
      low.push_back(double{fine.t[s]} - 0.5 * fine.dt[s]);
      high.push_back(double{fine.t[s]} + 0.5 * fine.dt[s]);
      fine_w.push_back(fine.weight[s]);
    }
    sum += interlevel(static_cast<int>(low.size()), low.data(), high.data(), fine_w.data(),
                      level.bins, edges.data(), w.data(), 1.0, unused.data(), scratch);
  }
  return sum;
}

TEST(Proposals, GradientOfEachNetworkMatchesDifferencesAlongAnyDirection) {
  FieldState field;
  field.create(proposing(Modality::visible, 1), Modality::visible, 1);
  for (DensityNetwork* network : field.density_networks())
    for (std::size_t i = 0; i < network->grid.table.size(); ++i)  // exact in half precision
      network->grid.table.value(i) = std::round((random_uniform(8, 1, i) - 0.5f) * 256) / 256;
  field.refresh();
  const Kernels& kernels = kernels_for(Isa::avx2);
  std::vector<DrawnRay> rays;
  for (int r = 0; r < 8; ++r) {
    const float a = 0.7f * static_cast<float>(r);
    const Ray ray{
        {std::cos(a), std::sin(a), 0.1f}, {-std::cos(a + 0.1f), -std::sin(a + 0.1f), 0}, 1};
    rays.push_back({.ray = ray, .jitter = 0.1f * static_cast<float>(r)});
  }
  RayBlock fine;
  fine.clear();
  ProposalBlock asked;
  add_proposed(field, kernels, rays, {}, asked, fine);
  EXPECT_EQ(fine.samples(), 8 * 17);
  forward(field, kernels, {1e-9f, 0.0f}, fine);

  std::array<std::vector<float>, 2> gradient;
  for (std::size_t k = 0; k < 2; ++k) gradient[k].assign(field.proposals[k].mlp.weights.size(), 0);
  const double total = backward_proposals(field, kernels, fine, 1.0f, asked, gradient);
  EXPECT_NEAR(total,
              loss_of(field, kernels, fine, asked, 0) + loss_of(field, kernels, fine, asked, 1),
              1e-4 * total);
  for (std::size_t k = 0; k < 2; ++k) {
    SCOPED_TRACE("proposal " + std::to_string(k));
    const auto moved = [&] {
      field.refresh();
      return loss_of(field, kernels, fine, asked, k);
    };
    DensityNetwork& network = field.proposals[k];
    test::expect_random_slopes(network.mlp.weights.value, gradient[k], test::layers_of(network.mlp),
                               1e-4f, 0.06, moved);
    HashEncoding& grid = network.grid;
    const std::vector<float> of_table =
        test::table_gradient(kernels, grid, asked.levels[k].position01.data(),
                             asked.samples(static_cast<int>(k)), asked.levels[k].grid.data());
    std::vector<float> values = grid.table.values();
    test::expect_random_slopes(values, of_table, test::levels_of(grid), 1.0f / 2048, 0.06, [&] {
      grid.table.set_values(values);
      return moved();
    });
    grid.table.set_values(values);
  }
}

TEST(Proposals, LearnTheToySceneAndRepeatForAnyThreads) {
  Dataset data = test::toy_scene(Modality::visible, 12);
  data.depth = test::toy_depth(data);
  TrainOptions options = proposing(Modality::visible, 250);
  options.holdout_every = 6;
  options.eval_count = 1;
  Field fields[2];
  for (const int threads : {1, 2}) {
    set_thread_count(threads);
    const auto report = train(data, options, {}, fields[threads - 1]);
    ASSERT_TRUE(report) << report.error().message();
    EXPECT_EQ(report->skipped_steps, 0);
    EXPECT_GT(report->best_psnr, 17);
  }
  set_thread_count(0);
  EXPECT_EQ(fields[0].state().snapshot(0).values, fields[1].state().snapshot(0).values);
}

}  // namespace
}  // namespace orbitfuse::nerf
