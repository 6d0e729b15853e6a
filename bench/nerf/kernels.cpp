// SPDX-License-Identifier: BSD-3-Clause
// The inner loops one by one, per instruction set: ns a sample on one core, and GFLOP/s of the
// perceptrons.
//   nerf_kernels [--benchmark_filter=encode] [--benchmark_out=kernels.json]
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cmath>

#include "core/numeric/random.hpp"
#include "core/system/cpu.hpp"
#include "recon/nerf/field/network.hpp"

namespace {

using namespace orbitfuse;
using namespace orbitfuse::nerf;

constexpr int samples = 1 << 14;

/// Positions of samples in the order of evaluation: along rays through the scene, or anywhere.
std::vector<float> positions(bool along_rays) {
  std::vector<float> out;
  constexpr int per_ray = 32;
  for (std::uint64_t i = 0; i < samples; ++i)
    for (std::uint64_t d = 0; d < 3; ++d) {
      if (!along_rays) {
        out.push_back(random_uniform(1, d, i));
        continue;
      }
      const std::uint64_t ray = i / per_ray;
      const float from = random_uniform(2, d, ray), to = random_uniform(3, d, ray);
      const float part = static_cast<float>(i % per_ray) / per_ray;
      out.push_back(from + part * (to - from));
    }
  return out;
}

HashEncoding grid_of(int log2_table) {
  HashEncoding grid;
  grid.create(8, 4, log2_table, 16, 1024, 7);
  return grid;
}

void per_sample(benchmark::State& state, double flop_per_sample = 0) {
  const auto done = static_cast<double>(state.iterations()) * samples;
  state.counters["ns/sample"] =
      benchmark::Counter(done * 1e-9, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  if (flop_per_sample > 0)
    state.counters["GFLOP/s"] =
        benchmark::Counter(done * flop_per_sample * 1e-9, benchmark::Counter::kIsRate);
}

void encode(benchmark::State& state, const Kernels& kernels, int log2_table, bool along_rays) {
  const HashEncoding grid = grid_of(log2_table);
  const auto at = positions(along_rays);
  std::vector<float> out(static_cast<std::size_t>(samples) * static_cast<std::size_t>(grid.width));
  for (auto _ : state) grid.encode(kernels, at.data(), samples, out.data());
  per_sample(state);
}

void scatter(benchmark::State& state, const Kernels& kernels, int log2_table, bool along_rays) {
  HashEncoding grid = grid_of(log2_table);
  const auto at = positions(along_rays);
  const std::vector<float> gradient(static_cast<std::size_t>(samples) * 4, 1e-3F);
  for (auto _ : state)
    for (std::size_t l = 0; l < grid.levels.size(); ++l) {
      const GridTable::Level table = grid.table.level(grid.levels, l);
      kernels.scatter(grid.levels[l], table.lines, table.touched, at.data(), samples,
                      gradient.data());
    }
  per_sample(state);
}

struct Perceptron {
  Mlp mlp;
  std::vector<float> in, dout, din, dweights, scratch_a, scratch_b;
  Mlp::Activations a;
  double flop = 0;  ///< of one sample forwards

  explicit Perceptron(const std::vector<int>& widths) {
    mlp.create(widths, 5);
    in.resize(static_cast<std::size_t>(samples * mlp.in()));
    for (std::size_t i = 0; i < in.size(); ++i) in[i] = random_uniform(6, 0, i) - 0.5F;
    dout.assign(static_cast<std::size_t>(samples * mlp.out()), 1e-3F);
    din.resize(in.size());
    dweights.resize(mlp.weights.size());
    for (const Mlp::Layer& layer : mlp.layers) flop += 2.0 * layer.in * layer.out;
  }
};

void forward(benchmark::State& state, const Kernels& kernels, const std::vector<int>& widths) {
  Perceptron p(widths);
  for (auto _ : state) p.mlp.forward(kernels, samples, p.in.data(), p.a);
  per_sample(state, p.flop);
}

void forward_and_backward(benchmark::State& state, const Kernels& kernels,
                          const std::vector<int>& widths) {
  Perceptron p(widths);
  // In blocks as in training, so that activations stay in the cache.
  constexpr int block = 512;
  for (auto _ : state)
    for (int first = 0; first < samples; first += block) {
      const float* in = p.in.data() + first * p.mlp.in();
      p.mlp.forward(kernels, block, in, p.a);
      p.mlp.backward(kernels, block, in, p.a, p.dout.data(), p.din.data(), p.scratch_a, p.scratch_b,
                     p.dweights.data());
    }
  per_sample(state, 3 * p.flop);
}

/// One step of training on the grid: 4 k samples are scattered, then Adam takes what they touched.
void scatter_and_adam(benchmark::State& state, const Kernels& kernels, int log2_table,
                      bool only_adam) {
  HashEncoding grid = grid_of(log2_table);
  constexpr int of_step = 4096;
  const auto at = positions(true);
  const std::vector<float> gradient(static_cast<std::size_t>(of_step) * 4, 1e-3F);
  AdamStep step;
  step.learning_rate = 1e-3F;
  int turn = 0;
  for (auto _ : state) {
    const float* position = at.data() + 3 * of_step * (turn++ % (samples / of_step));
    for (std::size_t l = 0; l < grid.levels.size(); ++l) {
      const GridTable::Level table = grid.table.level(grid.levels, l);
      if (only_adam) state.PauseTiming();
      kernels.scatter(grid.levels[l], table.lines, table.touched, position, of_step,
                      gradient.data());
      if (only_adam) state.ResumeTiming();
      kernels.adam_lines(step, table.words, table.touched, table.lines,
                         grid.half.data() + grid.levels[l].offset);
    }
  }
  state.counters["ns/sample"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * of_step * 1e-9,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void register_all(Isa isa) {
  const Kernels& kernels = kernels_for(isa);
  const auto add = [&](const std::string& what, auto function, auto... arguments) {
    benchmark::RegisterBenchmark(fmt::format("{}/{}", what, name(isa)).c_str(), function, kernels,
                                 arguments...);
  };
  for (const int table : {15, 17, 19})
    for (const bool rays : {true, false}) {
      const std::string where = fmt::format("8x4,2^{},{}", table, rays ? "rays" : "random");
      add("encode," + where, encode, table, rays);
      add("scatter," + where, scatter, table, rays);
    }
  const std::vector<int> density = {32, 64, 16}, color = {32, 64, 64, 16};
  add("forward,32-64-16", forward, density);
  add("forward,32-64-64-16", forward, color);
  add("forward+backward,32-64-16", forward_and_backward, density);
  add("forward+backward,32-64-64-16", forward_and_backward, color);
  for (const int table : {15, 17})
    for (const bool only_adam : {false, true})
      add(fmt::format("{},8x4,2^{}", only_adam ? "adam" : "scatter+adam", table), scatter_and_adam,
          table, only_adam);
}

}  // namespace

int main(int argc, char** argv) {
  fmt::print("{}\n", cpu_description());
  for (const Isa isa : {Isa::avx2, Isa::avx512, Isa::avx512bf16, Isa::amx})
    if (isa <= best_isa()) register_all(isa);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
