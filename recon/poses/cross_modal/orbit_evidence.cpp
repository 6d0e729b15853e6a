// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/orbit_evidence.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/system/trace.hpp"
#include "recon/alignment/edge_field.hpp"
#include "recon/poses/cross_modal/edge_lines.hpp"
#include "recon/poses/cross_modal/orbit_frames.hpp"
#include "recon/poses/scene_views.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {
namespace {

/// Lines that enough views confirm: as many witnesses as still leave a few hundred lines.
std::vector<EdgeLine> confirmed(const std::vector<EdgeLine>& lines) {
  for (const std::size_t views : {5u, 4u, 3u}) {
    std::vector<EdgeLine> kept;
    for (const EdgeLine& line : lines)
      if (line.views.size() >= views) kept.push_back(line);
    if (kept.size() >= 250 || views == 3) return kept;
  }
  return lines;
}

SearchView search_view(const OrbitEvidence& evidence, std::size_t i) {
  const double sigma_px = 2.0 * evidence.frames[i]->width / 640.0;
  return {orientation_field(evidence.images[i], sigma_px),
          upright(evidence.turn, evidence.lens.camera)};
}

}  // namespace

Result<OrbitEvidence> gather_evidence(const Session& session, const Reconstruction& visible,
                                      const std::vector<const FrameRecord*>& stations,
                                      const Progress& progress) {
  const TraceSpan span("edge lines of the visible scene");
  const Similarity3d canonical_from_visible = canonical_from_world(visible.views, {});
  Reconstruction canonical = visible;
  move_world(canonical, canonical_from_visible);
  ORBITFUSE_ASSIGN(const std::vector<EdgeLine> all_lines,
                   visible_edge_lines(session, canonical, {}, progress));
  const std::vector<EdgeLine> lines = confirmed(all_lines);
  if (lines.size() < 30)
    return fail(
        ErrorKind::quality, "poses.thermal",
        fmt::format("{} edges of the visible scene are confirmed by three views", lines.size()),
        "more visible views, or a scene with edges that both cameras see");
  std::vector<Eigen::Vector3d> centers;
  for (const PosedView& view : canonical.views)
    centers.push_back(camera_center(view.cam_from_world));
  OrbitEvidence evidence{lens_of(session, *stations.front()), LineModel(lines, centers), stations};
  evidence.canonical_from_visible = canonical_from_visible;
  const Camera& lens = evidence.lens.camera;
  for (std::size_t i = 0; i < stations.size(); ++i) {
    ORBITFUSE_ASSIGN(cv::Mat values, straight_luminance(session, *stations[i], lens));
    evidence.images.push_back(std::move(values));
    evidence.search.push_back(search_view(evidence, i));
  }
  const Camera& seen = canonical.views.front().camera;
  evidence.similar_distance = lens.fx / lens.width * seen.width / seen.fx;
  return evidence;
}

OrbitEvidence turned(OrbitEvidence evidence, QuarterTurn turn) {
  const double width = upright(evidence.turn, evidence.lens.camera).width;
  evidence.turn.clockwise = (evidence.turn.clockwise + turn.clockwise) % 4;
  for (std::size_t i = 0; i < evidence.images.size(); ++i) {
    evidence.images[i] = upright(turn, evidence.images[i]);
    evidence.search[i] = search_view(evidence, i);
  }
  evidence.similar_distance *= width / upright(evidence.turn, evidence.lens.camera).width;
  return evidence;
}

std::vector<PosedView> blank_views(const OrbitEvidence& evidence) {
  std::vector<PosedView> views;
  for (const FrameRecord* frame : evidence.frames)
    views.push_back({frame->file, upright(evidence.turn, evidence.lens.camera), {}});
  return views;
}

Result<std::vector<OrbitHypothesis>> search(const OrbitEvidence& evidence,
                                            const Progress& progress) {
  const TraceSpan span("orbit search");
  OrbitSearchOptions options;
  options.nearest = 0.4 * evidence.similar_distance;
  options.farthest = 1.8 * evidence.similar_distance;
  // Renders decide; a rival that isn't opened can't be told from the best. Few views have few
  // votes: of half an orbit of `statue` the true start came sixth.
  const bool few = evidence.search.size() < few_views;
  options.hypotheses = few ? 10 : 4;
  ORBITFUSE_ASSIGN(const OrbitTable table,
                   tabulate_orbit(evidence.lines, evidence.search, options, progress));
  std::vector<OrbitHypothesis> found;
  for (const std::vector<Station>& layout : layouts_of(evidence.frames))
    for (OrbitHypothesis& hypothesis : search_orbit(table, layout, options))
      found.push_back(std::move(hypothesis));
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& x, const auto& y) { return x.score > y.score; });
  const std::size_t most = few ? 12 : 6;
  if (found.size() > most) found.resize(most);
  return found;
}

}  // namespace orbitfuse
