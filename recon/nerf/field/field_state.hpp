// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "core/modality.hpp"
#include "recon/nerf/field/device_copy.hpp"
#include "recon/nerf/field/march_settings.hpp"
#include "recon/nerf/field/network.hpp"
#include "recon/nerf/field/network_shape.hpp"
#include "recon/nerf/field/occupancy.hpp"
#include "recon/nerf/field/refined_pose.hpp"
#include "recon/nerf/field/space.hpp"
#include "recon/nerf/history.hpp"
#include "recon/nerf/options.hpp"
#include "recon/nerf/value_span.hpp"

namespace orbitfuse::nerf {

/// Position to density: a hash encoding and a perceptron with one hidden layer.
struct DensityNetwork {
  HashEncoding grid;
  Mlp mlp;
};

/// The parameters that make the picture; also kept for the best step.
struct Snapshot {
  int step = 0;
  double psnr = 0;
  std::vector<std::vector<float>> values;
  std::vector<std::uint64_t> occupied;
  std::vector<std::uint8_t> codes;                ///< the occupancy's: they place the samples
  std::vector<std::vector<float>> level_weights;  ///< of each density network
  std::vector<RefinedPose> poses;                 ///< refine_poses
  bool empty() const { return values.empty(); }
};

/// Cubes round the scene, each twice as wide as the one before.
inline constexpr int occupancy_cascades = 5;

struct FieldState {
  Modality modality = Modality::visible;
  bool thermal_is_gray = false;
  TrainOptions options;  ///< as trained: architecture and sampling
  Space space;
  ValueSpan span;

  DensityNetwork main;
  Mlp color;
  std::vector<DensityNetwork> proposals;   ///< Sampling::proposal
  Parameters image_offsets;                ///< per training view, in units of the span
  std::vector<RefinedPose> refined_poses;  ///< per view of the dataset (refine_poses)
  Occupancy occupancy;

  int step = 0;
  int rays_per_step = 0;
  double train_psnr = 0, samples_per_ray = 0;
  std::vector<ViewRecord> views;  ///< of the dataset
  History history;                ///< empty in a finished field: equal fields are equal files
  Snapshot best;
  mutable DeviceCopy device_copy;  ///< of these parameters

  int channels() const { return modality == Modality::visible ? 3 : 1; }
  void create(const TrainOptions& with, Modality what, int view_count);
  /// act(set) for all trainable sets in a fixed order: GridTable or Parameters.
  template <class Act>
  void each_set(const Act& act) {
    act(main.grid.table);
    act(main.mlp.weights);
    act(color.weights);
    act(image_offsets);
    for (DensityNetwork& p : proposals) {
      act(p.grid.table);
      act(p.mlp.weights);
    }
  }
  std::vector<DensityNetwork*> density_networks();  ///< the main one, then the proposals
  void refresh();                                   ///< derived layouts after parameters changed
  Snapshot snapshot(double psnr);
  void restore(const Snapshot& from);
  MarchSettings march_settings() const;
};

}  // namespace orbitfuse::nerf
