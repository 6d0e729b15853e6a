// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "recon/nerf/device/engine.hpp"
#include "recon/nerf/field/field_state.hpp"
#include "recon/nerf/rendering/proposal.hpp"
#include "recon/nerf/training/backward.hpp"
#include "recon/nerf/training/pixel_tiles.hpp"
#include "recon/nerf/training/pose_steps.hpp"
#include "recon/nerf/training/scene.hpp"

namespace orbitfuse::nerf {

/// The optimisation loop's one turn: draw rays, march, forward, backward, scatter, Adam. Where a
/// device is in use (recon/nerf/device) and can, it makes the turn; then the field's parameters
/// here are those of the last settle(). Its functions throw device::Refused.
class Trainer {
 public:
  /// `heldout[i]` views are never drawn from.
  /// Views that train move if TrainOptions::refine_poses says so.
  Trainer(FieldState& field, std::vector<NormalisedView>& views, const std::vector<bool>& heldout,
          const Kernels& kernels = kernels_for(best_isa()));

  /// One step; `progress` in [0, 1] is the place in the schedule. False: a gradient was not
  /// finite, nothing was changed.
  bool step(double progress);

  bool on_device() const { return device_ != nullptr; }
  /// Brings the field's parameters, occupancy and pending pose sums up to date.
  void settle();

  long rays() const { return rays_; }
  long samples() const { return samples_; }

 private:
  struct Block {
    RayBlock rays;
    std::vector<RayTarget> targets;
    std::vector<float> grid;  ///< [level][sample][feature]
    ProposalBlock proposals;  ///< Sampling::proposal
    std::vector<DrawnRay> drawn;
  };

  DrawnPixel known_pixel(std::uint64_t bits) const;
  void draw(Block& block, int begin, int end, const device::StepPlan& plan, double progress);
  bool proposing() const { return field_.options.sampling == Sampling::proposal; }
  bool proposals_learn(double progress) const;
  device::StepPlan plan(double progress) const;
  void bring_in_levels(double progress);
  device::StepOutcome step_here(const device::StepPlan& plan, double progress);
  void take_account(const device::StepOutcome& outcome);
  void apply(const device::StepPlan& plan, const BlockGradients& gradients, bool with_proposals);
  void apply_to_networks(const device::StepPlan& plan, const BlockGradients& gradients,
                         bool with_proposals);
  void record_densities();
  void update_occupancy(double progress);
  std::optional<std::array<float, 3>> beside_occupied(std::uint64_t draw) const;
  void probe_cells();
  void watch_poses(const Block& block, std::vector<PoseSums>& sums) const;
  void collect_pose_sums();
  void move_views();

  FieldState& field_;
  std::vector<NormalisedView>& views_;
  const Kernels& kernels_;
  std::vector<int> training_;  ///< indices of the views that train
  PixelTiles tiles_;
  std::int64_t pixels_ = 0;               ///< of them
  std::vector<std::int64_t> known_ends_;  ///< running count of pixels with known distance
  std::vector<Block> blocks_;
  std::vector<BlockGradients> shards_;
  std::vector<std::vector<PoseSums>> pose_shards_;  ///< [shard][view] of one step (refine_poses)
  std::unique_ptr<device::Steps> device_;           ///< null: the processor
  bool behind_ = false;         ///< field_ is: the device has made steps since the last settle()
  std::uint64_t earlier_rays_;  ///< of the run's parts before this one
  long rays_ = 0, samples_ = 0;
};

}  // namespace orbitfuse::nerf
