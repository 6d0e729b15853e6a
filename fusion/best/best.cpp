// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/best/best.hpp"

#include <fmt/format.h>

#include <array>
#include <opencv2/imgproc.hpp>

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
  const auto bad = [](const char* field, double value, const char* rule) {
    return fail(ErrorKind::usage, std::string("best.") + field, fmt::format("{}", value), rule);
  };
  if (levels < 0 || levels > 12) return bad("levels", levels, "must be in 0..12");
  if (energy_radius_px < 0 || energy_radius_px > 15)
    return bad("energy_radius_px", energy_radius_px, "must be in 0..15");
  if (!(sharpness > 0 && sharpness <= 64)) return bad("sharpness", sharpness, "must be in (0, 64]");
  if (!(contrast_kept >= 0 && contrast_kept <= 1))
    return bad("contrast_kept", contrast_kept, "must be in 0..1");
  if (!(visible_preference >= 0 && visible_preference <= 255))
    return bad("visible_preference", visible_preference, "must be in 0..255");
  if (!(brightness_weight >= 0 && brightness_weight <= 1))
    return bad("brightness_weight", brightness_weight, "must be in 0..1");
  return {};
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
