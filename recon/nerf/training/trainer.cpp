// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/trainer.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "core/numeric/random.hpp"
#include "core/system/parallel.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr int rays_per_block = 32;
constexpr int shard_count = 16;  ///< of weight gradients; fixed, so sums do not depend on threads
constexpr int occupancy_every = 16;
constexpr int occupancy_warmup = 64;
constexpr int pose_every =
    25;  ///< steps; where views are many, the rays of several such turns make a step
constexpr double poses_move_until = 0.9;  ///< of the run: the last details are of poses that stay
constexpr float known_depth_margin = 1.08f;  ///< a wrong depth must be able to move

enum Stream : std::uint64_t { pixel_stream = 1, jitter_stream = 2, probe_stream = 4 };

/// What the learning rates are multiplied by: warm-up, then half a cosine down to 1/100.
double schedule(int step, double progress) {
  const double warmup = std::min(1.0, (step + 1) / 30.0);
  return warmup * (0.01 + 0.99 * 0.5 * (1 + std::cos(std::numbers::pi * progress)));
}

double depth_weight(const TrainOptions& o, double progress) {
  if (o.depth_end <= 0 || progress >= o.depth_end) return o.depth_final_weight;
  const double part = progress / o.depth_end;
  return o.depth_weight * (1 - part) + o.depth_final_weight * part;
}

/// Mip-NeRF 360's schedule: the exponent rises from 0 to 1 over the first thirtieth of the run.
float proposal_anneal(double progress) {
  const double part = std::min(1.0, 30 * progress);
  return static_cast<float>(10 * part / (9 * part + 1));
}

/// Far from the object before a plain background: the ray meets no cell. Some are drawn all the
/// same, for the background's colour.
constexpr int background_every = 16;
bool shows_nothing(const NormalisedView& view, int x, int y) {
  const int rim_px = std::clamp(view.target.cols / 50, 4, 100);
  return !view.clearance_px.empty() && view.clearance_px.at<std::uint8_t>(y, x) > rim_px;
}

/// Scatters one level's gradients of a block.
struct LevelGradient {
  int count;
  const float *position01, *gradient;
};

}  // namespace

Trainer::Trainer(FieldState& field, std::vector<NormalisedView>& views,
                 const std::vector<bool>& heldout, const Kernels& kernels)
    : field_(field), views_(views), kernels_(kernels) {
  std::int64_t pixels = 0, known = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (heldout[i]) continue;
    training_.push_back(static_cast<int>(i));
    pixels += static_cast<std::int64_t>(views[i].target.total());
    known += static_cast<std::int64_t>(views[i].known.size());
    pixel_ends_.push_back(pixels);
    known_ends_.push_back(known);
  }
  shards_.resize(shard_count);
  if (field.options.refine_poses)
    pose_shards_.assign(shard_count, std::vector<PoseSums>(views.size()));
  if (field_.rays_per_step == 0)
    field_.rays_per_step =
        proposing() ? std::max(1, field_.options.samples_per_step / field_.options.fine_samples)
                    : 512;
}

void Trainer::draw(Block& block, int begin, int end, double progress) {
  const TrainOptions& o = field_.options;
  const auto key = [&](int ray) {
    return static_cast<std::uint64_t>(field_.step) * 1000003u + static_cast<std::uint64_t>(ray);
  };
  const float supervision = static_cast<float>(depth_weight(o, progress));
  // Sparse points are few: while they count, a quarter of the rays goes through them.
  const bool sparse = known_ends_.back() > 0 && known_ends_.back() < pixel_ends_.back() / 10;
  block.rays.clear();
  block.targets.clear();
  block.drawn.clear();
  const MarchSettings settings = field_.march_settings();
  for (int i = begin; i < end; ++i) {
    for (int attempt = 0; attempt < 8; ++attempt) {
      const std::uint64_t draw_key = key(i) * 8 + static_cast<unsigned>(attempt);
      const std::uint64_t bits = random_bits(o.seed, pixel_stream, draw_key);
      const bool at_known = sparse && supervision > 0 && i % 4 == 0;
      const auto& ends = at_known ? known_ends_ : pixel_ends_;
      const auto pick = static_cast<std::int64_t>(bits % static_cast<std::uint64_t>(ends.back()));
      const auto slot =
          static_cast<std::size_t>(std::upper_bound(ends.begin(), ends.end(), pick) - ends.begin());
      const int index = training_[slot];
      const NormalisedView& view = views_[static_cast<std::size_t>(index)];
      std::int64_t pixel = pick - (slot > 0 ? ends[slot - 1] : 0);
      if (at_known) pixel = view.known[static_cast<std::size_t>(pixel)];
      const int x = static_cast<int>(pixel % view.target.cols),
                y = static_cast<int>(pixel / view.target.cols);
      if (shows_nothing(view, x, y) && (bits >> 32) % background_every != 0) continue;
      RayTarget target;
      const float* stored = view.target.ptr<float>(y) + x * field_.channels();
      DrawnRay drawn;
      if (!std::isfinite(stored[0]) || !view.rays.ray(x + 0.5, y + 0.5, drawn.ray)) continue;
      std::copy_n(stored, field_.channels(), target.value);
      target.view = index;
      target.x = x;
      target.y = y;
      const float distance = view.distance.at<float>(y, x);
      if (std::isfinite(distance)) {
        // What lies behind a known surface isn't seen. Sparse points are too few to gain from it.
        if (!sparse) drawn.far = distance * known_depth_margin;
        target.distance = distance;
        target.depth_weight = supervision;
      }
      block.targets.push_back(target);
      drawn.jitter = random_uniform(o.seed, jitter_stream, draw_key);
      block.drawn.push_back(drawn);
      break;
    }
  }
  if (proposing())
    add_proposed(field_, kernels_, block.drawn,
                 {.near = settings.near, .anneal = proposal_anneal(progress)}, block.proposals,
                 block.rays);
  else
    block.rays.add(field_.occupancy, settings, block.drawn);
}

/// As nerfacto: every step at first, every fifth after a sixth of the run.
bool Trainer::proposals_learn(double progress) const {
  const int every = std::clamp(static_cast<int>(30 * progress), 1, 5);
  return proposing() && field_.step % every == 0;
}

bool Trainer::step(double progress) {
  const TrainOptions& o = field_.options;
  const int rays = field_.rays_per_step;
  const int count = (rays + rays_per_block - 1) / rays_per_block;
  if (static_cast<int>(blocks_.size()) < count) blocks_.resize(static_cast<std::size_t>(count));
  for (std::size_t b = static_cast<std::size_t>(count); b < blocks_.size(); ++b)
    blocks_[b].rays.clear();
  if (o.level_anneal_end > 0) {
    const double on = progress / o.level_anneal_end * o.levels;
    for (std::size_t l = 0; l < field_.main.grid.levels.size(); ++l)
      field_.main.grid.level_weight[l] =
          static_cast<float>(std::clamp(on + 2 - static_cast<double>(l), 0.0, 1.0));
  }
  LossSettings loss;
  loss.per_ray = 1.0f / static_cast<float>(rays);
  loss.distortion_weight = static_cast<float>(o.distortion_weight);
  loss.huber = field_.modality == Modality::thermal ? 0.02f : 0.0f;
  const bool with_proposals = proposals_learn(progress);
  const bool posing = o.refine_poses && progress > poses_move_from && progress < poses_move_until;
  parallel_for(shard_count, [&](int shard) {
    BlockGradients& gradients = shards_[static_cast<std::size_t>(shard)];
    gradients.reset(field_);
    for (int b = shard; b < count; b += shard_count) {
      Block& block = blocks_[static_cast<std::size_t>(b)];
      draw(block, b * rays_per_block, std::min(rays, (b + 1) * rays_per_block), progress);
      forward(field_, kernels_, {}, block.rays);
      backward(field_, kernels_, loss, block.targets, block.rays, gradients, block.grid);
      if (posing) watch_poses(block, pose_shards_[static_cast<std::size_t>(shard)]);
      if (with_proposals)
        gradients.interlevel += backward_proposals(field_, kernels_, block.rays, loss.per_ray,
                                                   block.proposals, gradients.proposals);
    }
  });
  for (int shard = 1; shard < shard_count; ++shard)
    shards_[0].add(shards_[static_cast<std::size_t>(shard)]);
  const BlockGradients& gradients = shards_[0];

  long drawn = 0, samples = 0;
  for (int b = 0; b < count; ++b) {
    const RayBlock& block = blocks_[static_cast<std::size_t>(b)].rays;
    drawn += static_cast<long>(block.rays.size());
    samples += block.samples();
  }
  rays_ += drawn;
  samples_ += samples;
  const bool finite = gradients.all_parts_finite();
  if (finite && drawn > 0) {
    AdamStep adam;
    const double scheduled = schedule(field_.step, progress);
    adam.learning_rate = static_cast<float>(o.learning_rate * scheduled);
    adam.correction1 = static_cast<float>(1.0 / (1 - std::pow(adam.beta1, field_.step + 1)));
    adam.correction2 = static_cast<float>(1.0 / (1 - std::pow(adam.beta2, field_.step + 1)));
    AdamStep network = adam;
    network.learning_rate = static_cast<float>(o.network_learning_rate * scheduled);
    network.weight_decay = 1e-6f;
    apply(adam, network, gradients, with_proposals);
    const double mse =
        gradients.squared_error / static_cast<double>(std::max(1l, gradients.channels));
    const double psnr = -10 * std::log10(std::max(mse, 1e-12));
    field_.train_psnr = field_.step == 0 ? psnr : 0.98 * field_.train_psnr + 0.02 * psnr;
  }
  const double per_ray = static_cast<double>(samples) / static_cast<double>(std::max(1l, drawn));
  field_.samples_per_ray =
      field_.step == 0 ? per_ray : 0.9 * field_.samples_per_ray + 0.1 * per_ray;
  if (!proposing()) {
    field_.rays_per_step = std::clamp(
        static_cast<int>(o.samples_per_step / std::max(1.0, field_.samples_per_ray)), 128, 16384);
    if (finite) update_occupancy(progress);
  }
  ++field_.step;
  if (posing) move_views();
  return finite;
}

/// By how much each ray's picture differs, and at what distance it saw what it shows.
void Trainer::watch_poses(const Block& block, std::vector<PoseSums>& sums) const {
  const RayBlock& b = block.rays;
  int row = 0;
  for (std::size_t r = 0; r < b.rays.size(); ++r) {
    float value[3];
    ray_value(field_, b, static_cast<int>(r), row, value);
    float opacity = 0, distance = 0;
    for (auto i = static_cast<std::size_t>(b.first[r]);
         i < static_cast<std::size_t>(b.first[r] + b.used[r]); ++i) {
      opacity += b.weight[i];
      distance += b.weight[i] * b.t[i];
    }
    if (opacity < 0.5f) continue;
    const RayTarget& target = block.targets[r];
    const auto view = static_cast<std::size_t>(target.view);
    for (int c = 0; c < field_.channels(); ++c) value[c] += field_.image_offsets.value[view];
    add_ray(views_[view], target.x, target.y, value, distance / opacity, sums[view]);
  }
}

void Trainer::move_views() {
  for (const int index : training_) {
    const auto view = static_cast<std::size_t>(index);
    RefinedPose& refined = field_.refined_poses[view];
    for (std::vector<PoseSums>& shard : pose_shards_) {
      if (shard[view].rays > 0) refined.pending.add(shard[view]);
      shard[view] = {};
    }
    if (field_.step % pose_every == 0 && refined.pending.rays >= fewest_pose_rays) {
      take_step(refined.pending, field_.space, refined, views_[view]);
      refined.pending = {};
    }
  }
}

void Trainer::apply(const AdamStep& grid_step, const AdamStep& network_step,
                    const BlockGradients& gradients, bool with_proposals) {
  // Nothing is written by two of these. Finer levels are larger, and the grids take the longest.
  std::vector<std::function<void()>> tasks;
  const auto update_grid = [&](HashEncoding& grid, const auto& gradient_of) {
    for (std::size_t index = grid.levels.size(); index-- > 0;) {
      if (grid.level_weight[index] <= 0) continue;
      tasks.emplace_back([this, &grid, &grid_step, gradient_of, index] {
        const GridLevel& level = grid.levels[index];
        const GridTable::Level table = grid.table.level(grid.levels, index);
        for (const Block& block : blocks_) {
          if (block.rays.samples() == 0) continue;
          const LevelGradient g = gradient_of(block);
          kernels_.scatter(level, table.lines, table.touched, g.position01, g.count,
                           g.gradient + index * static_cast<std::size_t>(g.count) *
                                            static_cast<std::size_t>(grid.features));
        }
        // At once, while the lines are in the cache.
        kernels_.adam_lines(grid_step, table.words, table.touched, table.lines,
                            grid.half.data() + level.offset);
      });
    }
  };
  update_grid(field_.main.grid, [](const Block& block) {
    return LevelGradient{block.rays.samples(), block.rays.position01.data(), block.grid.data()};
  });
  for (std::size_t k = 0; with_proposals && k < field_.proposals.size(); ++k)
    update_grid(field_.proposals[k].grid, [k](const Block& block) {
      const ProposalBlock::Level& level = block.proposals.levels[k];
      return LevelGradient{block.proposals.samples(static_cast<int>(k)), level.position01.data(),
                           level.grid.data()};
    });
  if (!proposing()) tasks.emplace_back([this] { record_densities(); });
  tasks.emplace_back([&] { apply_to_networks(network_step, gradients, with_proposals); });
  parallel_tasks(tasks);
}

void Trainer::apply_to_networks(const AdamStep& network_step, const BlockGradients& gradients,
                                bool with_proposals) {
  const auto update = [&](Parameters& p, const std::vector<float>& grad, const AdamStep& step) {
    std::copy(grad.begin(), grad.end(), p.grad.begin());
    kernels_.adam(step, static_cast<std::int64_t>(p.size()), p.value.data(), p.first.data(),
                  p.second.data(), p.grad.data());
  };
  const auto update_network = [&](Mlp& network, const std::vector<float>& grad) {
    update(network.weights, grad, network_step);
    network.refresh();
  };
  update_network(field_.main.mlp, gradients.mlp);
  update_network(field_.color, gradients.color);
  for (std::size_t k = 0; with_proposals && k < field_.proposals.size(); ++k)
    update_network(field_.proposals[k].mlp, gradients.proposals[k]);
  if (field_.options.per_image_offset) {
    AdamStep slow = network_step;
    slow.learning_rate *= 0.1f;
    slow.weight_decay = 0;
    update(field_.image_offsets, gradients.offsets, slow);
    // The mean offset is the scene's temperature, not drift.
    double mean = 0;
    for (const int v : training_) mean += field_.image_offsets.value[static_cast<std::size_t>(v)];
    mean /= static_cast<double>(training_.size());
    for (const int v : training_)
      field_.image_offsets.value[static_cast<std::size_t>(v)] -= static_cast<float>(mean);
  }
}

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
  const double threshold = field_.options.occupancy_threshold * (progress < 0.6 ? 1.0 : 0.3);
  probe_cells();
  field_.occupancy.update(0.95f, static_cast<float>(threshold));
}

/// Brings cells back: neighbours of occupied cells whose density is above the threshold.
void Trainer::probe_cells() {
  Occupancy& grid = field_.occupancy;
  constexpr int probes = 4096;
  std::vector<float> position, sigma(probes);
  const auto cells = static_cast<std::uint64_t>(grid.cell_count());
  for (int i = 0; i < probes * 16 && static_cast<int>(position.size()) < 3 * probes; ++i) {
    const std::uint64_t bits = random_bits(
        field_.options.seed, probe_stream,
        static_cast<std::uint64_t>(field_.step) * probes * 16 + static_cast<unsigned>(i));
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
