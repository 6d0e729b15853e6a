// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/pipeline/stage.hpp"
#include "core/session/session.hpp"
#include "recon/assembly/training_data.hpp"
#include "recon/nerf/photo_detail.hpp"

namespace orbitfuse::stages {

/// What the recorded frames of a modality add to pictures of its trained field, `width_px` wide:
/// from where training left the views, at one exposure, without those whose poses are doubted.
/// Errors: input (a stage's record is cut), usage (options).
Result<nerf::PhotoDetail> recorded_detail(const pipeline::StageContext& context,
                                          const Session& session, Modality modality,
                                          Samples samples, int width_px,
                                          const nerf::DetailOptions& options);

}  // namespace orbitfuse::stages
