// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/pyramid/image_pair.hpp"

namespace orbitfuse::fusion {

/// One band of a source with what its contrast is relative to.
struct BandSource {
  Plane band;
  Plane energy;  ///< of the band, local mean of squares
  Plane level;   ///< the source's low pass below the band
};

struct BandMix {
  float exponent;       ///< of the energy ratio
  float contrast_kept;  ///< 0..1
  float base_pull;      ///< how far the source that the base has goes before the stronger one
  float opposite_pull;  ///< likewise, where the bands are opposite
};

/// level + gain * (w v + (1 - w) t), w = E_v^n / (E_v^n + e^-p E_t^n): the band chosen softly by
/// energy, and by b, the share of the visible source in the levels: p = (base_pull + opposite_pull
/// o) (2b - 1). o, 0..1, is how far the bands are opposite: -`common` / sqrt(E_v E_t), where
/// `common` is the local mean of their product. An edge on the other source's level would be a
/// halo, the more where one falls and the other rises. A detail that moves to another level than
/// its own looks stronger or weaker (Weber's law; Toet 1990's contrast pyramid keeps the ratio
/// whole): gain goes `contrast_kept` of the way from 1 to the ratio of the levels, within 2/3 and
/// 3/2. `level` is the fused low pass below the band.
Plane mix_band(const BandSource& visible, const BandSource& thermal, const Plane& common,
               const Plane& level, const Plane& visible_share, const BandMix& rule);

}  // namespace orbitfuse::fusion
