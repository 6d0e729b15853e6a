// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/best/best.hpp"

#include <array>
#include <opencv2/imgproc.hpp>

#include "core/option_range.hpp"
#include "core/system/parallel.hpp"
#include "fusion/best/band_mix.hpp"
#include "fusion/best/base_rule.hpp"
#include "fusion/pyramid/bands.hpp"
#include "fusion/pyramid/pyramid.hpp"

namespace orbitfuse::fusion {
namespace {

/// Bands of one source, finest first, still without their energies, and its base.
struct Source {
  std::vector<BandSource> bands;
  Plane base;
};

Source source_of(const Plane& image, int levels) {
  Source source{{}, image};
  for (int i = 0; i < levels; ++i) {
    Plane reduced;
    BandSource band;
    cv::pyrDown(source.base, reduced);
    cv::pyrUp(reduced, band.level, source.base.size());
    band.band = source.base - band.level;
    source.bands.push_back(std::move(band));
    source.base = reduced;
  }
  return source;
}

Plane energy_of(const Plane& band, int radius) {
  const int window = 2 * radius + 1;
  Plane energy;
  cv::GaussianBlur(band.mul(band), energy, {window, window}, 0, 0, cv::BORDER_REFLECT_101);
  return energy;
}

}  // namespace

Status BestOptions::validate() const {
  const OptionCheck check("best");
  ORBITFUSE_TRY(check("levels", levels, from_to(0, 12)));
  ORBITFUSE_TRY(check("energy_radius_px", energy_radius_px, from_to(0, 15)));
  ORBITFUSE_TRY(check("sharpness", sharpness, above_up_to(0, 64)));
  ORBITFUSE_TRY(check("contrast_kept", contrast_kept, from_to(0, 1)));
  ORBITFUSE_TRY(check("visible_preference", visible_preference, from_to(0, 255)));
  return check("brightness_weight", brightness_weight, from_to(0, 1));
}

Result<Plane> fuse_best(const Plane& visible, const Plane& thermal, const BestOptions& options,
                        BestReport* report) {
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_TRY(check_pair(visible, thermal));
  BestReport own;
  BestReport& said = report ? *report : own;
  said = {};
  if (differing_share(visible, thermal, 0) == 0) {
    said.skipped = true;
    return visible.clone();
  }
  const int levels = pyramid_levels(visible.size(), options.levels, 8);
  std::array<Source, 2> sources;
  parallel_for(2, [&](int i) {
    sources[static_cast<std::size_t>(i)] = source_of(i == 0 ? visible : thermal, levels);
  });
  auto& [v, t] = sources;
  std::vector<bool> skip;
  for (std::size_t i = 0; i < v.bands.size(); ++i) {
    skip.push_back(silent(v.bands[i].band, t.bands[i].band));
    if (skip[i]) said.levels_skipped += 1.0 / levels;
  }
  parallel_for(2, [&](int k) {
    Source& source = sources[static_cast<std::size_t>(k)];
    for (std::size_t i = 0; i < source.bands.size(); ++i)
      if (!skip[i])
        source.bands[i].energy = energy_of(source.bands[i].band, options.energy_radius_px);
  });
  Plane fused = fuse_base(v.base, t.base,
                          {static_cast<float>(options.visible_preference),
                           static_cast<float>(options.brightness_weight)});
  const BandMix rule{static_cast<float>(options.sharpness / 2),
                     static_cast<float>(options.contrast_kept)};
  for (std::size_t i = v.bands.size(); i-- > 0;) {
    Plane level;
    cv::pyrUp(fused, level, v.bands[i].band.size());
    fused = skip[i] ? level : mix_band(v.bands[i], t.bands[i], level, rule);
  }
  return fused;
}

}  // namespace orbitfuse::fusion
