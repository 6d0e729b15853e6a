// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/progress.hpp"
#include "core/session/session.hpp"
#include "recon/poses/cross_modal/edge_alignment.hpp"
#include "recon/poses/cross_modal/orbit_search.hpp"

// Poses by lines: one start angle of the orbit taken to aligned views, by the visible scene's
// edge lines alone.
namespace orbitfuse {

struct LensGuess {
  Camera camera;
  double focal_relative_sigma = 0.03;
  bool guessed = false;
};
/// What the session knows of the lens that took a frame.
LensGuess lens_of(const Session& session, const FrameRecord& frame);

/// Thermal stations and what they are looked for in.
struct OrbitWork {
  LensGuess lens;
  LineModel lines;
  std::vector<const FrameRecord*> frames;
  std::vector<cv::Mat> images;
};

/// One hypothesis taken to the end.
struct AlignedOrbit {
  OrbitHypothesis hypothesis;
  std::vector<AlignmentView> views;
  AlignmentReport report;
  std::vector<double> support;  ///< agreement of each view's edges with the scene's lines

  double mean_support() const {
    double sum = 0;
    for (const double s : support) sum += s;
    return sum / static_cast<double>(std::max<std::size_t>(support.size(), 1));
  }
};

Result<AlignedOrbit> align_orbit(const OrbitWork& work, const OrbitHypothesis& hypothesis,
                                 const Progress& progress);

/// Where a view should be if it kept to its loop: the operator's height and distance change little
/// within one, and the azimuths follow the stations up to one offset.
OrbitPrior loop_prior(const std::vector<OrbitPose>& poses, const OrbitHypothesis& hypothesis,
                      std::size_t view);

}  // namespace orbitfuse
