// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/orbit_frames.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <tuple>

#include "recon/poses/cross_modal/orbit_search.hpp"
#include "recon/poses/cross_modal/tracking_views.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {
namespace {

/// Views of a walk that place each other; more where nothing but their order is known.
constexpr std::size_t min_stations = 4, min_unknown_stations = 8;

using Lens = std::tuple<std::string, int, int>;

Lens lens_key(const FrameRecord& frame) { return {frame.device, frame.width, frame.height}; }

/// The lens that most of the frames asked for were taken with; the first of several.
template <class Asked>
Lens most_common(const std::vector<const FrameRecord*>& frames, const Asked& asked) {
  std::map<Lens, int> counts;
  for (const FrameRecord* frame : frames)
    if (asked(*frame)) ++counts[lens_key(*frame)];
  Lens best;
  int most = 0;
  for (const FrameRecord* frame : frames)
    if (asked(*frame) && counts[lens_key(*frame)] > most)
      best = lens_key(*frame), most = counts[best];
  return best;
}

void in_capture_order(std::vector<const FrameRecord*>& frames) {
  std::stable_sort(frames.begin(), frames.end(), [](const FrameRecord* a, const FrameRecord* b) {
    return a->sequence < b->sequence;
  });
}

}  // namespace

Result<OrbitFrames> orbit_frames(const std::vector<const FrameRecord*>& frames, int limit) {
  const auto has_station = [](const FrameRecord& f) {
    return !f.tracking && tells_azimuth(f.station);
  };
  const auto is_view = [](const FrameRecord& f) { return !f.tracking; };
  const auto of = [&](const Lens& lens, const auto& asked) {
    std::vector<const FrameRecord*> list;
    for (const FrameRecord* frame : frames)
      if (asked(*frame) && lens_key(*frame) == lens) list.push_back(frame);
    return list;
  };
  OrbitFrames orbit;
  Lens lens = most_common(frames, has_station);
  orbit.stations = of(lens, has_station);
  const std::size_t with_station = orbit.stations.size();
  const bool declared = with_station >= min_stations;
  if (!declared) {
    lens = most_common(frames, is_view);
    orbit.stations = of(lens, is_view);
    in_capture_order(orbit.stations);
    if (orbit.stations.size() < min_unknown_stations)
      return fail(
          ErrorKind::quality, "poses.thermal",
          fmt::format("{} thermal frames of one camera carry stations, {} are needed to place an "
                      "orbit ({} where only their order is known)",
                      with_station, min_stations, min_unknown_stations),
          "import again and say how the views were taken, e.g. --station-spacing-deg 30 --loops 2");
  }
  orbit.tracking = of(lens, [](const FrameRecord& f) { return f.tracking; });
  in_capture_order(orbit.tracking);
  orbit.tracking = thinned(orbit.tracking, limit);
  for (const FrameRecord* frame : frames) {
    if (frame->tracking) continue;
    if (lens_key(*frame) != lens)
      orbit.left_out.emplace_back(frame->file, "it is of another camera or size than most views");
    else if (declared && !tells_azimuth(frame->station))
      orbit.left_out.emplace_back(frame->file, "it has no station, the others have");
  }
  return orbit;
}

std::vector<std::vector<Station>> layouts_of(const std::vector<const FrameRecord*>& stations) {
  if (!all_have_stations(stations)) return station_layouts(stations.size());
  std::vector<Station> layout;
  for (const FrameRecord* frame : stations) layout.push_back(*frame->station);
  return {layout};
}

}  // namespace orbitfuse
