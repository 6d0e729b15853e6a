// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "app/pipeline/stage.hpp"
#include "app/stages/run_config.hpp"
#include "app/stages/session_input.hpp"
#include "recon/nerf/photo_detail.hpp"

// One function a stage, one file each; build_stages.cpp puts them in order.
namespace orbitfuse::stages {

inline constexpr const char* field_file = "field.bin";
inline constexpr const char* cloud_file = "cloud.ply";  ///< absent when no point was consistent

/// What stages read besides each other's folders; shared, so that a stage outlives its maker.
struct StageInputs {
  std::shared_ptr<const SessionInput> session;
  std::shared_ptr<RunConfig> config;
  /// Made once, for point clouds, new views and held-out ones; of both fields, whose frames have
  /// names of their own.
  std::shared_ptr<nerf::KeptRenders> where_frames_stand;
};

pipeline::Stage poses_stage(const StageInputs& in, Modality modality);
pipeline::Stage depth_stage(const StageInputs& in);
pipeline::Stage train_stage(const StageInputs& in, Modality modality);
pipeline::Stage register_stage(const StageInputs& in);
pipeline::Stage render_stage(const StageInputs& in);
pipeline::Stage fuse_stage(const StageInputs& in);
pipeline::Stage metrics_stage(const StageInputs& in);
pipeline::Stage report_stage(const StageInputs& in);

}  // namespace orbitfuse::stages
