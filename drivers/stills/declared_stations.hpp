// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "drivers/stills/import.hpp"

namespace orbitfuse {

/// Of all loops.
int station_count(const DeclaredStations& declared);

/// What becomes of frames that are more than those stations; empty where they are fewer.
std::string rest_words(const DeclaredStations& declared, int frames);
/// A spacing that doesn't divide the circle leaves a gap between the last station and the first;
/// empty: it does.
std::string gap_words(const DeclaredStations& declared);

/// The station of the frame at this position in capture order; an elevation known otherwise serves
/// where none is declared.
Station station_at(const DeclaredStations& declared, int position,
                   std::optional<double> known_elevation_deg);

}  // namespace orbitfuse
