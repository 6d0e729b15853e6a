// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/stages/session_input.hpp"
#include "core/geometry/reconstruction.hpp"
#include "recon/nerf/dataset.hpp"

namespace orbitfuse::stages {

/// The images of the posed views, at most `max_width_px` wide, with everything scaled alike.
Result<nerf::Dataset> training_data(const SessionInput& input, const Reconstruction& model,
                                    int max_width_px, const Progress& progress);

/// One frame as a field sees it: RGB 0..1, or kelvin (gray levels of 8-bit thermal).
Result<cv::Mat> field_image(const std::filesystem::path& file, Modality modality, bool gray);

}  // namespace orbitfuse::stages
