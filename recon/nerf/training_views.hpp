// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "recon/nerf/dataset.hpp"
#include "recon/nerf/value_span.hpp"

// Which views of a dataset train() learns from, for those who prepare more from the same views
// (depth maps, spans of values): nothing of a held-out view may reach the field by another way.
namespace orbitfuse::nerf {

/// Views that don't train: those marked so, and every n-th of the others (0 = none).
std::vector<bool> heldout_views(const Dataset& dataset, int holdout_every);

/// Thermal views of which more than half is no temperature: a broken transfer, a shutter in the
/// way.
std::vector<bool> broken_views(const Dataset& dataset);
/// Share of an image's pixels that hold no value.
double invalid_share(const cv::Mat& image);

/// Of the views given to train(): the broken ones, and of the others those that don't train.
std::vector<bool> left_out_views(const Dataset& given, int holdout_every);

/// What training may know: the dataset without held-out views, their depth maps and the points that
/// only they saw. Images are shared, not copied.
Dataset training_part(const Dataset& dataset, const std::vector<bool>& heldout);

/// Thermal: the 0.1 and 99.9 percentile over these views, at least 1 K wide. Visible: 0..1.
ValueSpan estimate_span(const Dataset& training);

}  // namespace orbitfuse::nerf
