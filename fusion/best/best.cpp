// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/best/best.hpp"

#include <array>
#include <opencv2/imgproc.hpp>

#include "core/option_range.hpp"
#include "core/system/parallel.hpp"
#include "fusion/best/band_mix.hpp"
#include "fusion/best/base_rule.hpp"
#include "fusion/best/halo_rule.hpp"
#include "fusion/best/settle_levels.hpp"
#include "fusion/best/small_things.hpp"
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

Plane local_mean_of_product(const Plane& a, const Plane& b, int radius) {
  const int window = 2 * radius + 1;
  Plane mean;
  cv::GaussianBlur(a.mul(b), mean, {window, window}, 0, 0, cv::BORDER_REFLECT_101);
  return mean;
}

/// A share of the picture for each band, finest first.
std::vector<Plane> in_bands(const Plane& share, std::size_t bands) {
  std::vector<Plane> all;
  for (std::size_t i = 0; i < bands; ++i) {
    Plane reduced = share;
    if (i > 0) cv::pyrDown(all.back(), reduced);
    all.push_back(reduced);
  }
  return all;
}

/// What is small and stands out in one source, and how far the base's choice of the visible source
/// holds there.
struct SmallThings {
  Plane heat, marks;                   ///< hot things; things of the visible image that aren't hot
  std::vector<Plane> not_hot, marked;  ///< of each band
};

SmallThings small_things(const Plane& visible, const Plane& thermal, const HaloRule& rule,
                         std::size_t bands) {
  SmallThings things;
  things.heat = small_heat(thermal, rule.least_heat);
  const Plane not_hot = 1 - things.heat;
  things.marks = small_marks(visible, rule.least_mark).mul(not_hot);
  things.not_hot = in_bands(not_hot, bands);
  things.marked = in_bands(things.marks, bands);
  return things;
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
  return fuse_best(visible, thermal, options, HaloRule{}, report);
}

Result<Plane> fuse_best(const Plane& visible, const Plane& thermal, const BestOptions& options,
                        const HaloRule& halo, BestReport* report) {
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
  Source &v = sources[0], &t = sources[1];
  std::vector<bool> skip;
  for (std::size_t i = 0; i < v.bands.size(); ++i) {
    skip.push_back(silent(v.bands[i].band, t.bands[i].band));
    if (skip[i]) said.levels_skipped += 1.0 / levels;
  }
  std::vector<Plane> common(v.bands.size());
  SmallThings small;
  parallel_for(4, [&](int k) {
    if (k == 3) small = small_things(visible, thermal, halo, v.bands.size());
    for (std::size_t i = 0; k < 3 && i < v.bands.size(); ++i) {
      if (skip[i]) continue;
      const Plane &a = (k == 1 ? t : v).bands[i].band, &b = (k == 0 ? v : t).bands[i].band;
      Plane& target = k == 0 ? v.bands[i].energy : k == 1 ? t.bands[i].energy : common[i];
      target = local_mean_of_product(a, b, options.energy_radius_px);
    }
  });
  auto [fused, weight] = fuse_base(
      v.base, t.base,
      {static_cast<float>(options.visible_preference),
       static_cast<float>(options.brightness_weight), halo.coherence, halo.decision, halo.lean});
  const BandMix rule{static_cast<float>(options.sharpness / 2),
                     static_cast<float>(options.contrast_kept), halo.pull, halo.opposite};
  for (std::size_t i = v.bands.size(); i-- > 0;) {
    Plane level, wide;
    cv::pyrUp(fused, level, v.bands[i].band.size());
    cv::pyrUp(weight, wide, v.bands[i].band.size());
    weight = wide;
    fused = skip[i] ? level
                    : mix_band(v.bands[i], t.bands[i], common[i], level,
                               cv::max(weight.mul(small.not_hot[i]), small.marked[i]), rule);
  }
  return halo.settled ? settle_levels(fused, visible, thermal, small.heat, small.marks) : fused;
}

}  // namespace orbitfuse::fusion
