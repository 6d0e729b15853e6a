// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <functional>

#include "bench/fusion/modes.hpp"
#include "bench/fusion/report.hpp"

namespace orbitfuse::bench {
namespace {

/// A knob, the values it is tried at, and how it is set.
struct Knob {
  FusionMethod method;
  const char* name;
  std::vector<double> values;
  std::function<void(FusionOptions&, double)> set;
};

std::vector<Knob> all_knobs() {
  using enum FusionMethod;
  using O = FusionOptions;
  const auto whole = [](double v) { return static_cast<int>(v); };
  return {
      {best, "levels", {3, 5, 6}, [=](O& o, double v) { o.best.levels = whole(v); }},
      {best, "sharpness", {2, 6, 24}, [](O& o, double v) { o.best.sharpness = v; }},
      {best,
       "energy radius",
       {1, 3, 8},
       [=](O& o, double v) { o.best.energy_radius_px = whole(v); }},
      {best, "contrast kept", {0, 0.2, 0.35, 1}, [](O& o, double v) { o.best.contrast_kept = v; }},
      {best,
       "visible preference",
       {0, 1, 4},
       [](O& o, double v) { o.best.visible_preference = v; }},
      {best,
       "brightness weight",
       {0, 0.01, 0.04},
       [](O& o, double v) { o.best.brightness_weight = v; }},
      {ms_srif, "levels", {3, 5}, [=](O& o, double v) { o.ms_srif.levels = whole(v); }},
      {ms_srif, "stride", {1, 4, 8}, [=](O& o, double v) { o.ms_srif.stride_px = whole(v); }},
      {ms_srif, "most atoms", {8, 16, 32}, [=](O& o, double v) { o.ms_srif.max_atoms = whole(v); }},
      {ms_srif,
       "patch left",
       {0, 0.03, 0.1, 0.3},
       [](O& o, double v) { o.ms_srif.relative_residual = v; }},
      {ms_srif,
       "certain ratio",
       {0, 3, 2, 1.2, 1},
       [](O& o, double v) { o.ms_srif.certain_ratio = v; }},
      {pca_msif,
       "iterations",
       {5, 15, 30, 60},
       [=](O& o, double v) { o.pca_msif.smoother.iterations = whole(v); }},
      {pca_msif,
       "cycles",
       {0, 1, 4, 8},
       [=](O& o, double v) { o.pca_msif.smoother.cycles = whole(v); }},
      {cnn_lpif,
       "network bands",
       {0, 2, 5},
       [=](O& o, double v) { o.cnn_lpif.network_bands = whole(v); }},
      {cnn_lpif,
       "network halvings",
       {1, 2},
       [=](O& o, double v) { o.cnn_lpif.network_halvings = whole(v); }},
      {cnn_lpif, "vote px", {1, 3, 11}, [=](O& o, double v) { o.cnn_lpif.vote_px = whole(v); }},
      {cnn_lpif,
       "match threshold",
       {0.6, 1},
       [](O& o, double v) { o.cnn_lpif.match_threshold = v; }},
      {cnn_lpif, "flat within", {-1, 2, 8, 16}, [](O& o, double v) { o.cnn_lpif.flat_within = v; }},
  };
}

}  // namespace

int sweep(const std::filesystem::path& folder, bool knobs, const std::filesystem::path& out) {
  const auto pairs = load_pairs(folder);
  const Pair timed = timed_pair(pairs);
  std::vector<Row> rows;
  const auto add = [&](Row row) {
    print(row);
    rows.push_back(std::move(row));
  };
  const auto show = [&](const std::string& what, const FusionOptions& options) {
    add({what, mean(scores(pairs, options)),
         times_of(9, [&] { fuse(timed.visible, timed.thermal, {}, options).value(); }), true});
  };
  print_header();
  for (const auto& [method, of_pairs] : reference_scores(folder, pairs))
    add({"reference " + method, mean(of_pairs), {}});
  for (const std::string& method : scored_methods()) {
    FusionOptions options;
    options.method = fusion_method(method).value();
    show(method, options);
  }
  if (knobs)
    for (const Knob& knob : all_knobs())
      for (const double value : knob.values) {
        FusionOptions options;
        options.method = knob.method;
        knob.set(options, value);
        show(fmt::format("{}, {} {}", name(knob.method), knob.name, value), options);
      }
  if (out.empty()) return 0;
  if (const Status written = write_reports(out, rows); !written) {
    fmt::print(stderr, "{}\n", written.error().message());
    return 4;
  }
  return 0;
}

}  // namespace orbitfuse::bench
