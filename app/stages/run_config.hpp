// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/config/settings.hpp"
#include "core/modality.hpp"
#include "fusion/fuse/fuse.hpp"
#include "recon/assembly/new_views.hpp"
#include "recon/depth/options.hpp"
#include "recon/nerf/nerf.hpp"
#include "recon/nerf/photo_detail.hpp"
#include "recon/poses/estimate_poses.hpp"

namespace orbitfuse::stages {

inline constexpr int unlimited_steps = 10'000'000;  ///< time ends the training

/// How one modality's field is trained; the fields of `options` come from its preset.
struct TrainConfig {
  nerf::TrainOptions options;
  int max_width_px = 400;  ///< training images; wider ones suit temperatures, these poses (run.md)
  nerf::ExportOptions cloud;
  /// Depth maps of the thermal views themselves, where no visible field gives the geometry; 0 =
  /// none. Wider ones match noise (nerf.md).
  int depth_width_px = 260;
};

struct RenderConfig {
  NewViewOptions path;
  std::string cameras;  ///< transforms.json of given cameras; empty = `path`
  std::string palette = "inferno";
  double min_opacity = 0.5;  ///< below it a pixel has no temperature and isn't fused
  nerf::RenderOptions visible;
  /// Temperatures are smooth: most pixels are what their neighbours are (docs/formats.md).
  nerf::RenderOptions thermal{.alike = 0.004};
  nerf::DetailOptions detail;
};

struct FuseConfig {
  std::vector<std::string> methods = fusion_method_names();
  FusionOptions options;  ///< its method is each of `methods` in turn

  Result<std::vector<FusionMethod>> chosen() const;
};

struct MetricsConfig {
  /// New views whose fused pictures are measured, spread over the path; 0 = all. Each costs as much
  /// as fusing it.
  int scored_views = 0;
};

/// Everything a run can be told; its defaults are those of config/orbitfuse.toml.
struct RunConfig {
  RunConfig();

  std::uint64_t seed = 1;
  PoseOptions poses;
  depth::DepthOptions depth;
  TrainConfig train_visible, train_thermal;
  RenderConfig render;
  FuseConfig fuse;
  MetricsConfig metrics;

  const TrainConfig& train(Modality modality) const {
    return modality == Modality::visible ? train_visible : train_thermal;
  }
  void set_seed(std::uint64_t value);
  Status validate() const;
  /// The keys, bound to this object, which must outlive them.
  config::Settings settings();
};

}  // namespace orbitfuse::stages
