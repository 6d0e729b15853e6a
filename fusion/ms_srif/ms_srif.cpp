// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/ms_srif/ms_srif.hpp"

#include <algorithm>

#include "core/option_range.hpp"
#include "core/system/parallel.hpp"
#include "fusion/pyramid/bands.hpp"
#include "fusion/pyramid/patch_dct.hpp"
#include "fusion/pyramid/pyramid.hpp"

namespace orbitfuse::fusion {
namespace {

/// Top-left corners 0, stride, ... and the last one that fits: every pixel is covered.
std::vector<int> corners(int length, int stride) {
  std::vector<int> list;
  for (int i = 0; i + patch_side <= length; i += stride) list.push_back(i);
  if (list.back() + patch_side < length) list.push_back(length - patch_side);
  return list;
}

float cut(const Plane& image, int x, int y, Eigen::VectorXf& patch) {
  for (int i = 0; i < patch_size; ++i) patch[i] = image(y + i / patch_side, x + i % patch_side);
  const float mean = patch.mean();
  patch.array() -= mean;
  return mean;
}

struct Tally {
  int patches = 0, flat = 0, certain = 0;
  long atoms = 0;
};

/// What a patch says beside its structure, in the sum of its samples: gray levels that the visible
/// source has for free (where neither holds structure people expect its level), and the share of a
/// mean that counts (lamps and hot bodies are bright without structure). The values are those of
/// `best` (best/best.hpp), which weren't chosen by this method's scores.
constexpr float visible_preference = 2, brightness_weight = 0.02F;

/// What decides a patch, by its structure and mean.
float activity_of_thermal(float structure, float mean) {
  return structure + patch_size * brightness_weight * std::max(0.0F, mean);
}
float activity_of_visible(float structure, float mean) {
  return activity_of_thermal(structure, mean) + patch_size * visible_preference;
}

/// Work space of one thread.
struct Coder {
  Coder(const MsSrifOptions& options, const Dictionary& dictionary_)
      : certain_ratio(static_cast<float>(options.certain_ratio)),
        stop{options.max_atoms, static_cast<float>(options.residual * patch_side),
             static_cast<float>(options.relative_residual)},
        dictionary(dictionary_),
        omp(dictionary_) {}

  void fuse_coded(float mean_v, float mean_t, Tally& tally) {
    omp.solve(v, stop, code_v);
    omp.solve(t, stop, code_t);
    tally.flat += code_v.atoms.empty() + code_t.atoms.empty();
    tally.atoms += static_cast<long>(code_v.atoms.size() + code_t.atoms.size());
    const float activity_v = activity_of_visible(code_v.l1(), mean_v),
                activity_t = activity_of_thermal(code_t.l1(), mean_t);
    // Where both count alike there is no winner.
    const float mean = activity_v > activity_t   ? mean_v
                       : activity_t > activity_v ? mean_t
                                                 : (mean_v + mean_t) / 2;
    const SparseCode& code = activity_v > activity_t ? code_v : code_t;
    fused.setConstant(mean);
    for (std::size_t i = 0; i < code.atoms.size(); ++i)
      fused += code.weights[i] * dictionary.atoms().col(code.atoms[i]);
  }

  void fuse(const Plane& visible, const Plane& thermal, int x, int y, Tally& tally) {
    const float mean_v = cut(visible, x, y, v), mean_t = cut(thermal, x, y, t);
    tally.patches += 2;
    if (certain_ratio > 0) {
      const float a = activity_of_visible(patch_activity(visible, x, y).structure, mean_v),
                  b = activity_of_thermal(patch_activity(thermal, x, y).structure, mean_t);
      if (std::max(a, b) > certain_ratio * std::min(a, b)) {
        fused = a > b ? v.array() + mean_v : t.array() + mean_t;
        tally.certain += 2;
        return;
      }
    }
    fuse_coded(mean_v, mean_t, tally);
  }

  float certain_ratio;
  OmpStop stop;
  const Dictionary& dictionary;
  BatchOmp omp;
  Eigen::VectorXf v{patch_size}, t{patch_size}, fused{patch_size};
  SparseCode code_v, code_t;
};

/// Fused patches of one row of corners, in the order of `xs`.
std::vector<Eigen::VectorXf> fuse_row(const Plane& visible, const Plane& thermal,
                                      const std::vector<int>& xs, int y, Coder& coder,
                                      Tally& tally) {
  std::vector<Eigen::VectorXf> fused;
  for (const int x : xs) {
    coder.fuse(visible, thermal, x, y, tally);
    fused.push_back(coder.fused);
  }
  return fused;
}

Plane fuse_base(const Plane& visible, const Plane& thermal, const MsSrifOptions& options,
                const Dictionary& dictionary, MsSrifReport& report) {
  const std::vector<int> xs = corners(visible.cols, options.stride_px),
                         ys = corners(visible.rows, options.stride_px);
  std::vector<std::vector<Eigen::VectorXf>> rows(ys.size());
  std::vector<Tally> tallies(ys.size());
  parallel_for(static_cast<int>(ys.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    Coder coder(options, dictionary);
    rows[k] = fuse_row(visible, thermal, xs, ys[k], coder, tallies[k]);
  });
  Plane sum = Plane::zeros(visible.size()), count = Plane::zeros(visible.size());
  long atoms = 0;
  for (std::size_t j = 0; j < ys.size(); ++j) {
    for (std::size_t i = 0; i < xs.size(); ++i)
      for (int p = 0; p < patch_size; ++p) {
        sum(ys[j] + p / patch_side, xs[i] + p % patch_side) += rows[j][i][p];
        count(ys[j] + p / patch_side, xs[i] + p % patch_side) += 1;
      }
    report.patches += tallies[j].patches;
    report.flat_patches += tallies[j].flat;
    report.certain_patches += tallies[j].certain;
    atoms += tallies[j].atoms;
  }
  report.atoms_per_patch = static_cast<double>(atoms) / report.patches;
  return sum / count;
}

}  // namespace

Status MsSrifOptions::validate() const {
  const OptionCheck check("ms_srif");
  ORBITFUSE_TRY(check("levels", levels, from_to(0, 12)));
  ORBITFUSE_TRY(check("stride_px", stride_px, from_to(1, patch_side)));
  ORBITFUSE_TRY(check("max_atoms", max_atoms, from_to(1, patch_size)));
  ORBITFUSE_TRY(check("residual", residual, from_to(0, 255)));
  if (certain_ratio != 0)  // 0: off
    ORBITFUSE_TRY(check("certain_ratio", certain_ratio, from_to(1, 1e6)));
  return check("relative_residual", relative_residual,
               OptionRange{.low = 0, .high = 1, .low_included = true, .high_included = false});
}

Result<Plane> fuse_ms_srif(const Plane& visible, const Plane& thermal, const MsSrifOptions& options,
                           MsSrifReport* report, const Dictionary& dictionary) {
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_TRY(check_pair(visible, thermal));
  MsSrifReport own;
  MsSrifReport& said = report ? *report : own;
  said = {};
  if (differing_share(visible, thermal, 0) == 0) {
    said.skipped = true;
    return visible.clone();
  }
  const int levels = pyramid_levels(visible.size(), options.levels, patch_side);
  LaplacianPyramid v, t;
  parallel_for(
      2, [&](int i) { (i == 0 ? v : t) = laplacian_pyramid(i == 0 ? visible : thermal, levels); });
  LaplacianPyramid fused;
  for (std::size_t i = 0; i < v.bands.size(); ++i) {
    const bool skip = silent(v.bands[i], t.bands[i]);
    if (skip) said.levels_skipped += 1.0 / levels;
    fused.bands.push_back(
        skip ? t.bands[i]
             : Plane(t.bands[i] +
                     share_by_magnitude(v.bands[i], t.bands[i]).mul(v.bands[i] - t.bands[i])));
  }
  fused.base = fuse_base(v.base, t.base, options, dictionary, said);
  return collapse(fused);
}

}  // namespace orbitfuse::fusion
