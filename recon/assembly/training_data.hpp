// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>

#include "core/geometry/reconstruction.hpp"
#include "core/progress.hpp"
#include "recon/nerf/dataset.hpp"

namespace orbitfuse {

/// What the samples of a modality's images are.
enum class Samples {
  color,   ///< CV_32FC3, RGB 0..1 as stored (sRGB)
  kelvin,  ///< CV_32FC1, NaN = no temperature
  gray,    ///< CV_32FC1, the levels of 8-bit thermal images, which are no temperatures
};

/// One image file as a field sees it. Errors: input (unreadable, no temperatures in it).
Result<cv::Mat> field_image(const std::filesystem::path& file, Samples samples);

/// The images of the posed views (files relative to `folder`), at most `max_width_px` wide, with
/// cameras, points and their observations scaled alike. `samples` is not color for a thermal model.
/// Errors: input (an image that can't be read or isn't of its camera's size), cancelled.
Result<nerf::Dataset> training_data(const std::filesystem::path& folder,
                                    const Reconstruction& model, Samples samples, int max_width_px,
                                    const Progress& progress);

}  // namespace orbitfuse
