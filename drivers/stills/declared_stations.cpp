// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/declared_stations.hpp"

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
