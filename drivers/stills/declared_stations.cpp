// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/declared_stations.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace orbitfuse {
namespace {

int stations_per_loop(const DeclaredStations& declared) {
  return std::max(1, static_cast<int>(std::lround(360 / declared.spacing_deg)));
}

}  // namespace

int station_count(const DeclaredStations& declared) {
  return declared.loops * stations_per_loop(declared);
}

std::string rest_words(const DeclaredStations& declared, int frames) {
  const int count = station_count(declared), per_loop = stations_per_loop(declared);
  if (frames <= count) return {};
  const int loops = (frames + per_loop - 1) / per_loop;
  return fmt::format(
      ": from frame {} on they are taken for {} that begin{} at 0 degrees again; if they are of "
      "the same loop give their true spacing, else --loops {}",
      count + 1, loops - declared.loops == 1 ? "a further loop" : "further loops",
      loops - declared.loops == 1 ? "s" : "", loops);
}

std::string gap_words(const DeclaredStations& declared) {
  const int per_loop = stations_per_loop(declared);
  const double last = 360 - (per_loop - 1) * declared.spacing_deg;
  constexpr double rounded = 0.01;  // of the spacing, as in 51.4286 for a seventh
  if (std::abs(last - declared.spacing_deg) < rounded * declared.spacing_deg) return {};
  return fmt::format(
      "{:g} degrees don't divide the circle: of {} stations a loop the last is {:.3g} degrees from "
      "the first",
      declared.spacing_deg, per_loop, last);
}

Station station_at(const DeclaredStations& declared, int position,
                   std::optional<double> known_elevation_deg) {
  const int per_loop = stations_per_loop(declared);
  Station station;
  station.loop = position / per_loop;
  station.index = position % per_loop;
  station.azimuth_deg = station.index * declared.spacing_deg;
  station.azimuth_sigma_deg.reset();  // where the orbit began is unknown
  station.elevation_sigma_deg.reset();
  if (station.loop < static_cast<int>(declared.elevations_deg.size())) {
    station.elevation_deg = declared.elevations_deg[static_cast<std::size_t>(station.loop)];
    station.elevation_sigma_deg = declared.elevation_sigma_deg;
  } else if (known_elevation_deg) {
    station.elevation_deg = *known_elevation_deg;
    station.elevation_sigma_deg = declared.elevation_sigma_deg;
  }
  return station;
}

}  // namespace orbitfuse
