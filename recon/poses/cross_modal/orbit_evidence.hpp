// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/geometry/quarter_turn.hpp"
#include "recon/poses/cross_modal/orbit_search.hpp"
#include "recon/poses/thermal_lens.hpp"

namespace orbitfuse {

/// Below, the search leaves more to renders.
inline constexpr std::size_t few_views = 16;

/// All that placing the stations needs, read once.
struct OrbitEvidence {
  LensGuess lens;
  LineModel lines;
  std::vector<const FrameRecord*> frames;
  QuarterTurn turn = {};             ///< that makes the frames upright
  std::vector<cv::Mat> images = {};  ///< upright, one a frame
  std::vector<SearchView> search = {};
  Similarity3d canonical_from_visible = {};
  double similar_distance = 1;  ///< from where the thermal image shows as much as the visible one
};

/// Lines of the visible scene, and the stations' images as they were taken. Errors: quality (too
/// few lines), unreadable files, cancelled.
Result<OrbitEvidence> gather_evidence(const Session& session, const Reconstruction& visible,
                                      const std::vector<const FrameRecord*>& stations,
                                      const Progress& progress);

/// The same frames, turned further.
OrbitEvidence turned(OrbitEvidence evidence, QuarterTurn turn);

/// Views without a pose, as renders are compared with them.
std::vector<PosedView> blank_views(const OrbitEvidence& evidence);

/// Where the lines have the orbit, best first. Errors: cancelled.
Result<std::vector<OrbitHypothesis>> search(const OrbitEvidence& evidence,
                                            const Progress& progress);

}  // namespace orbitfuse
