// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/mirrored_views.hpp"

#include <opencv2/core.hpp>

#include "core/system/trace.hpp"

namespace orbitfuse {
namespace {

/// Mirrored views stand about as far off: the object's size doesn't change.
constexpr double distance_reach = 1.13;
/// Views that are not mirrored lead by more at the first look.
constexpr double decided_at_first = 1.5;

Camera mirrored(Camera camera) {
  camera.cx = camera.width - camera.cx;
  return camera;
}

cv::Mat mirrored(const cv::Mat& image) {
  cv::Mat result;
  cv::flip(image, result, 1);
  return result;
}

SearchView mirrored(const SearchView& view) {
  SearchView result{mirrored(view.field), mirrored(view.camera)};
  // exp(2i angle) of a normal whose x turns round.
  for (cv::Vec2f& edge : cv::Mat_<cv::Vec2f>(result.field)) edge[1] = -edge[1];
  return result;
}

}  // namespace

Result<std::optional<MirroredSupport>> support_if_mirrored(const SceneRenderer& renderer,
                                                           const ChosenOrbit& chosen,
                                                           const Progress& progress) {
  const TraceSpan span("mirrored views");
  if (chosen.blank.size() < least_for_mirrored) return std::nullopt;
  OrbitSearchOptions options;
  options.nearest = chosen.hypothesis.radius / options.radius_ratio;
  options.farthest = chosen.hypothesis.radius * distance_reach;
  options.hypotheses = 1;
  std::vector<SearchView> search;
  for (const SearchView& view : chosen.search) search.push_back(mirrored(view));
  ORBITFUSE_ASSIGN(const OrbitTable table, tabulate_orbit(chosen.lines, search, options, progress));
  const std::vector<OrbitHypothesis> best =
      search_orbit(table, chosen.hypothesis.stations, options);
  OrbitViews orbit = chosen.orbit;
  for (cv::Mat& image : orbit.images) image = mirrored(image);
  std::vector<PosedView> blank = chosen.blank;
  for (PosedView& view : blank) view.camera = mirrored(view.camera);
  ORBITFUSE_ASSIGN(const RenderAlignment opening,
                   open_orbit({renderer, orbit, progress}, blank, best.front()));
  if (lead_standard_errors(opening, chosen.selected.opening) < -decided_at_first)
    return std::nullopt;
  const auto selected = select_by_renders(renderer, orbit, blank, best, progress);
  if (!selected && selected.error().kind == ErrorKind::quality) return std::nullopt;
  if (!selected) return tl::unexpected(selected.error());
  return MirroredSupport{
      lead_standard_errors(selected->alignment, chosen.selected.alignment),
      mean_support(selected->alignment) / mean_support(chosen.selected.alignment)};
}

}  // namespace orbitfuse
