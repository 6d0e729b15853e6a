// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "drivers/stills/import.hpp"

namespace orbitfuse {

/// Of all loops.
int station_count(const DeclaredStations& declared);

/// The station of the frame at this position in capture order; an elevation known otherwise serves
/// where none is declared.
Station station_at(const DeclaredStations& declared, int position,
                   std::optional<double> known_elevation_deg);

}  // namespace orbitfuse
