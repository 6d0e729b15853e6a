// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/trainer.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "core/numeric/random.hpp"
#include "core/system/parallel.hpp"
#include "recon/nerf/device/on_device.hpp"
#include "recon/nerf/field/draw_rules.hpp"
#include "recon/nerf/field/pose_row.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr int trained_per_block = 32;
constexpr int shard_count = 16;  ///< of weight gradients; fixed, so sums do not depend on threads
constexpr int pose_every =
    25;  ///< steps; where views are many, the rays of several such turns make a step
constexpr double poses_move_until = 0.9;  ///< of the run: the last details are of poses that stay

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

/// Before a plain background: the ray meets no cell.
bool shows_nothing(const NormalisedView& view, int x, int y) {
  return !view.clearance_px.empty() &&
         view.clearance_px.at<std::uint8_t>(y, x) > background_rim_px(view.target.cols);
}

/// Scatters one level's gradients of a block.
struct LevelGradient {
  int count;
  const float *position01, *gradient;
};

/// The device's copy of the field and its views. Pointers are read at once.
std::unique_ptr<device::Steps> start_on(device::Engine& engine, const FieldState& field,
                                        const std::vector<NormalisedView>& views,
                                        const std::vector<bool>& heldout,
                                        const PixelTilesView& tiles) {
  std::vector<device::Photo> photos;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const NormalisedView& view = views[i];
    assert(view.target.isContinuous() && view.distance.isContinuous());
    device::Photo photo;
    photo.rays = view.rays.numbers();
    photo.lattice = view.rays.lattice();
    photo.target = view.target.ptr<float>();
    photo.distance = view.distance.ptr<float>();
    photo.known = view.known.data();
    photo.known_count = static_cast<std::int64_t>(view.known.size());
    if (!view.clearance_px.empty()) {
      assert(view.clearance_px.isContinuous());
      photo.clearance_px = view.clearance_px.ptr<std::uint8_t>();
    }
    photo.trains = !heldout[i];
    photos.push_back(photo);
  }
  return engine.steps(device::all_numbers(field), photos, tiles);
}

}  // namespace

Trainer::Trainer(FieldState& field, std::vector<NormalisedView>& views,
                 const std::vector<bool>& heldout, const Kernels& kernels)
    : field_(field),
      views_(views),
      kernels_(kernels),
      tiles_(PixelTiles::of(views, heldout, field.options.texture_share)),
      earlier_rays_(static_cast<std::uint64_t>(field.history.rays)) {
  std::int64_t known = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (heldout[i]) continue;
    training_.push_back(static_cast<int>(i));
    pixels_ += static_cast<std::int64_t>(views[i].target.total());
    known += static_cast<std::int64_t>(views[i].known.size());
    known_ends_.push_back(known);
  }
  shards_.resize(shard_count);
  if (field.options.refine_poses)
    pose_shards_.assign(shard_count, std::vector<PoseSums>(views.size()));
  if (field_.rays_per_step == 0)
    field_.rays_per_step =
        proposing() ? std::max(1, field_.options.samples_per_step / field_.options.fine_samples)
                    : 512;
  if (device::Engine* engine = device::current(); engine != nullptr && !proposing())
    device_ = start_on(*engine, field, views, heldout, tiles_.view());
}

/// Of those whose distance is known.
DrawnPixel Trainer::known_pixel(std::uint64_t bits) const {
  const auto pick =
      static_cast<std::int64_t>(bits % static_cast<std::uint64_t>(known_ends_.back()));
  const auto slot = static_cast<std::size_t>(
      std::upper_bound(known_ends_.begin(), known_ends_.end(), pick) - known_ends_.begin());
  const int index = training_[slot];
  const NormalisedView& view = views_[static_cast<std::size_t>(index)];
  const int pixel =
      view.known[static_cast<std::size_t>(pick - (slot > 0 ? known_ends_[slot - 1] : 0))];
  return {index, pixel % view.target.cols, pixel / view.target.cols};
}

void Trainer::draw(Block& block, int begin, int end, const device::StepPlan& plan,
                   double progress) {
  const float supervision = plan.supervision;
  // Sparse points are few: while they count, a quarter of the rays goes through them.
  const bool sparse = points_are_sparse(known_ends_.back(), pixels_);
  block.rays.clear();
  block.targets.clear();
  block.drawn.clear();
  for (int i = begin; i < end; ++i) {
    const std::uint64_t ray = plan.first_ray + static_cast<unsigned>(i);
    for (int attempt = 0; attempt < draw_attempts; ++attempt) {
      const std::uint64_t key = draw_key(plan.step, i, attempt);
      const std::uint64_t bits = random_bits(plan.seed, pixel_stream, key);
      const bool at_known = sparse && supervision > 0 && i % known_every == 0;
      const auto [index, x, y] =
          at_known ? known_pixel(bits)
                   : pixel_at(tiles_.view(), pixel_bits(plan.seed, ray, attempt, bits));
      const NormalisedView& view = views_[static_cast<std::size_t>(index)];
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
      drawn.jitter = ray_jitter(plan.seed, ray);
      block.drawn.push_back(drawn);
      break;
    }
  }
  if (proposing())
    add_proposed(field_, kernels_, block.drawn,
                 {.near = plan.march.near, .anneal = proposal_anneal(progress)}, block.proposals,
                 block.rays);
  else
    block.rays.add(field_.occupancy, plan.march, block.drawn);
}

/// As nerfacto: every step at first, every fifth after a sixth of the run.
bool Trainer::proposals_learn(double progress) const {
  const int every = std::clamp(static_cast<int>(30 * progress), 1, 5);
  return proposing() && field_.step % every == 0;
}

device::StepPlan Trainer::plan(double progress) const {
  const TrainOptions& o = field_.options;
  device::StepPlan plan;
  plan.step = field_.step;
  plan.rays = field_.rays_per_step;
  plan.first_ray = earlier_rays_ + static_cast<std::uint64_t>(rays_);
  plan.seed = o.seed;
  plan.supervision = static_cast<float>(depth_weight(o, progress));
  plan.posing = o.refine_poses && progress > poses_move_from && progress < poses_move_until;
  plan.per_ray = 1.0f / static_cast<float>(plan.rays);
  plan.distortion_weight = static_cast<float>(o.distortion_weight);
  plan.huber = field_.modality == Modality::thermal ? 0.02f : 0.0f;
  plan.march = field_.march_settings();
  AdamStep& adam = plan.grid;
  const double scheduled = schedule(field_.step, progress);
  adam.learning_rate = static_cast<float>(o.learning_rate * scheduled);
  adam.correction1 = static_cast<float>(1.0 / (1 - std::pow(adam.beta1, field_.step + 1)));
  adam.correction2 = static_cast<float>(1.0 / (1 - std::pow(adam.beta2, field_.step + 1)));
  plan.network = adam;
  plan.network.learning_rate = static_cast<float>(o.network_learning_rate * scheduled);
  plan.network.weight_decay = 1e-6f;
  plan.with_offsets = o.per_image_offset;
  plan.offsets = plan.network;
  plan.offsets.learning_rate *= 0.1f;
  plan.offsets.weight_decay = 0;
  return plan;
}

/// Coarse to fine.
void Trainer::bring_in_levels(double progress) {
  const TrainOptions& o = field_.options;
  if (o.level_anneal_end <= 0) return;
  const double on = progress / o.level_anneal_end * o.levels;
  std::vector<float>& weight = field_.main.grid.level_weight;
  for (std::size_t l = 0; l < weight.size(); ++l)
    weight[l] = static_cast<float>(std::clamp(on + 2 - static_cast<double>(l), 0.0, 1.0));
  if (device_) device_->set_level_weight(weight);
}

bool Trainer::step(double progress) {
  bring_in_levels(progress);
  const device::StepPlan todo = plan(progress);
  behind_ = device_ != nullptr;
  const device::StepOutcome done = device_ ? device_->step(todo) : step_here(todo, progress);
  take_account(done);
  if (!proposing() && done.finite) update_occupancy(progress);
  ++field_.step;
  if (todo.posing) move_views();
  return done.finite;
}

device::StepOutcome Trainer::step_here(const device::StepPlan& plan, double progress) {
  const int count = (plan.rays + trained_per_block - 1) / trained_per_block;
  if (static_cast<int>(blocks_.size()) < count) blocks_.resize(static_cast<std::size_t>(count));
  for (std::size_t b = static_cast<std::size_t>(count); b < blocks_.size(); ++b)
    blocks_[b].rays.clear();
  const LossSettings loss{plan.per_ray, plan.distortion_weight, plan.huber};
  const bool with_proposals = proposals_learn(progress);
  parallel_for(shard_count, [&](int shard) {
    BlockGradients& gradients = shards_[static_cast<std::size_t>(shard)];
    gradients.reset(field_);
    for (int b = shard; b < count; b += shard_count) {
      Block& block = blocks_[static_cast<std::size_t>(b)];
      draw(block, b * trained_per_block, std::min(plan.rays, (b + 1) * trained_per_block), plan,
           progress);
      forward(field_, kernels_, {}, block.rays);
      backward(field_, kernels_, loss, block.targets, block.rays, gradients, block.grid);
      if (plan.posing) watch_poses(block, pose_shards_[static_cast<std::size_t>(shard)]);
      if (with_proposals)
        gradients.interlevel += backward_proposals(field_, kernels_, block.rays, loss.per_ray,
                                                   block.proposals, gradients.proposals);
    }
  });
  for (int shard = 1; shard < shard_count; ++shard)
    shards_[0].add(shards_[static_cast<std::size_t>(shard)]);
  const BlockGradients& gradients = shards_[0];

  device::StepOutcome done;
  for (int b = 0; b < count; ++b) {
    const RayBlock& block = blocks_[static_cast<std::size_t>(b)].rays;
    done.rays += static_cast<long>(block.rays.size());
    done.samples += block.samples();
  }
  done.channels = gradients.channels;
  done.squared_error = gradients.squared_error;
  done.finite = gradients.all_parts_finite();
  if (done.finite && done.rays > 0) apply(plan, gradients, with_proposals);
  field_.device_copy.forget();
  return done;
}

/// Of a step: the running error, and how many rays the next one gets.
void Trainer::take_account(const device::StepOutcome& done) {
  rays_ += done.rays;
  samples_ += done.samples;
  if (done.finite && done.rays > 0) {
    const double mse = done.squared_error / static_cast<double>(std::max(1l, done.channels));
    const double psnr = -10 * std::log10(std::max(mse, 1e-12));
    field_.train_psnr = field_.step == 0 ? psnr : 0.98 * field_.train_psnr + 0.02 * psnr;
  }
  const double per_ray =
      static_cast<double>(done.samples) / static_cast<double>(std::max(1l, done.rays));
  field_.samples_per_ray =
      field_.step == 0 ? per_ray : 0.9 * field_.samples_per_ray + 0.1 * per_ray;
  if (!proposing())
    field_.rays_per_step = std::clamp(
        static_cast<int>(field_.options.samples_per_step / std::max(1.0, field_.samples_per_ray)),
        128, 16384);
}

void Trainer::settle() {
  if (!behind_) return;
  behind_ = false;
  device::take_back(device_->fetch(), field_);
  collect_pose_sums();
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
    if (opacity < seen_opacity) continue;
    const RayTarget& target = block.targets[r];
    const auto view = static_cast<std::size_t>(target.view);
    for (int c = 0; c < field_.channels(); ++c) value[c] += field_.image_offsets.value[view];
    add_ray(views_[view], target.x, target.y, value, distance / opacity, sums[view]);
  }
}

/// What the views' rays have said since the last call joins what is pending.
void Trainer::collect_pose_sums() {
  if (!field_.options.refine_poses) return;
  const std::vector<PoseSums> noted = device_ ? device_->take_pose_sums() : std::vector<PoseSums>();
  for (const int index : training_) {
    const auto view = static_cast<std::size_t>(index);
    PoseSums& pending = field_.refined_poses[view].pending;
    if (device_ && noted[view].rays > 0) pending.add(noted[view]);
    for (std::vector<PoseSums>& shard : pose_shards_) {
      if (shard[view].rays > 0) pending.add(shard[view]);
      shard[view] = {};
    }
  }
}

void Trainer::move_views() {
  const bool due = field_.step % pose_every == 0;
  if (!device_ || due) collect_pose_sums();
  if (!due) return;
  for (const int index : training_) {
    const auto view = static_cast<std::size_t>(index);
    RefinedPose& refined = field_.refined_poses[view];
    if (refined.pending.rays < fewest_pose_rays) continue;
    take_step(refined.pending, field_.space, refined, views_[view]);
    refined.pending = {};
    if (device_) device_->place(index, views_[view].rays.numbers());
  }
}

void Trainer::apply(const device::StepPlan& plan, const BlockGradients& gradients,
                    bool with_proposals) {
  // Nothing is written by two of these. Finer levels are larger, and the grids take the longest.
  std::vector<std::function<void()>> tasks;
  const auto update_grid = [&](HashEncoding& grid, const auto& gradient_of) {
    for (std::size_t index = grid.levels.size(); index-- > 0;) {
      if (grid.level_weight[index] <= 0) continue;
      tasks.emplace_back([this, &grid, &plan, gradient_of, index] {
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
        kernels_.adam_lines(plan.grid, table.words, table.touched, table.lines,
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
  tasks.emplace_back([&] { apply_to_networks(plan, gradients, with_proposals); });
  parallel_tasks(tasks);
}

void Trainer::apply_to_networks(const device::StepPlan& plan, const BlockGradients& gradients,
                                bool with_proposals) {
  const auto update = [&](Parameters& p, const std::vector<float>& grad, const AdamStep& step) {
    std::copy(grad.begin(), grad.end(), p.grad.begin());
    kernels_.adam(step, static_cast<std::int64_t>(p.size()), p.value.data(), p.first.data(),
                  p.second.data(), p.grad.data());
  };
  const auto update_network = [&](Mlp& network, const std::vector<float>& grad) {
    update(network.weights, grad, plan.network);
    network.refresh();
  };
  update_network(field_.main.mlp, gradients.mlp);
  update_network(field_.color, gradients.color);
  for (std::size_t k = 0; with_proposals && k < field_.proposals.size(); ++k)
    update_network(field_.proposals[k].mlp, gradients.proposals[k]);
  if (plan.with_offsets) {
    update(field_.image_offsets, gradients.offsets, plan.offsets);
    // The mean offset is the scene's temperature, not drift.
    double mean = 0;
    for (const int v : training_) mean += field_.image_offsets.value[static_cast<std::size_t>(v)];
    mean /= static_cast<double>(training_.size());
    for (const int v : training_)
      field_.image_offsets.value[static_cast<std::size_t>(v)] -= static_cast<float>(mean);
  }
}

}  // namespace orbitfuse::nerf
