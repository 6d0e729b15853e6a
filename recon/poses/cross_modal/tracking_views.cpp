// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/tracking_views.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/numeric/median.hpp"

namespace orbitfuse {
namespace {

/// How far round a station's found azimuth lies from its nominal one.
double deviation_deg(const PassedStation& passed, double sign, double offset_deg) {
  return sign *
         std::remainder(passed.azimuth_deg - offset_deg - sign * passed.station.azimuth_deg, 360);
}

Station at(const Station& like, double azimuth_deg) {
  Station station = like;
  station.azimuth_deg = azimuth_deg;
  return station;
}

}  // namespace

std::vector<Station> stations_between(const std::vector<PassedStation>& passed,
                                      const std::vector<std::uint64_t>& tracking, bool clockwise,
                                      double offset_deg) {
  std::vector<Station> result;
  if (passed.empty()) return result;
  const double sign = clockwise ? -1 : 1;
  std::vector<PassedStation> way = passed;
  std::stable_sort(way.begin(), way.end(), [](const PassedStation& a, const PassedStation& b) {
    return a.sequence < b.sequence;
  });
  // Nominal azimuth plus what the found one deviates: degrees walked, from the device's first
  // station.
  const auto walked = [&](const PassedStation& p) {
    return p.station.azimuth_deg + deviation_deg(p, sign, offset_deg);
  };
  // Loop -> degrees walked where it begins: what its stations deviate in the median, as one alone
  // may be far off.
  std::map<int, std::vector<double>> deviations;
  for (const PassedStation& p : way)
    deviations[p.station.loop].push_back(deviation_deg(p, sign, offset_deg));
  std::map<int, double> begins;
  for (const PassedStation& p : way)
    begins.try_emplace(p.station.loop,
                       p.station.azimuth_deg + median(deviations.at(p.station.loop)));
  const std::size_t own_stream = static_cast<std::size_t>(std::count_if(
      tracking.begin(), tracking.end(),
      [&](std::uint64_t s) { return s < way.front().sequence || s > way.back().sequence; }));
  const bool apart = own_stream == tracking.size();
  const auto loops = static_cast<double>(begins.size());
  for (std::size_t k = 0; k < tracking.size(); ++k) {
    if (apart) {
      const double turns = loops * static_cast<double>(k) / static_cast<double>(tracking.size());
      const auto loop = std::next(begins.begin(), static_cast<std::ptrdiff_t>(turns));
      Station like;
      like.loop = loop->first;
      result.push_back(at(like, loop->second + 360 * (turns - std::floor(turns))));
      continue;
    }
    const auto after = std::find_if(
        way.begin(), way.end(), [&](const PassedStation& p) { return p.sequence > tracking[k]; });
    if (after == way.begin() || after == way.end()) {
      const PassedStation& end = after == way.begin() ? way.front() : way.back();
      result.push_back(at(end.station, walked(end)));
      continue;
    }
    const PassedStation &from = *std::prev(after), &to = *after;
    const double share = static_cast<double>(tracking[k] - from.sequence) /
                         static_cast<double>(to.sequence - from.sequence);
    const double step = std::remainder(walked(to) - walked(from), 360);
    result.push_back(at(share < 0.5 ? from.station : to.station, walked(from) + share * step));
  }
  return result;
}

std::vector<const FrameRecord*> thinned(const std::vector<const FrameRecord*>& frames, int limit) {
  const auto count = static_cast<int>(frames.size());
  if (count <= limit) return frames;
  std::vector<const FrameRecord*> chosen;
  for (int i = 0; i < limit; ++i)
    chosen.push_back(frames[static_cast<std::size_t>(static_cast<long>(i) * count / limit)]);
  return chosen;
}

}  // namespace orbitfuse
