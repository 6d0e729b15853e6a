// SPDX-License-Identifier: BSD-3-Clause
#include <sys/resource.h>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>

#include "recon/nerf/field/checkpoint.hpp"
#include "recon/nerf/training/exposure.hpp"
#include "recon/nerf/nerf.hpp"
#include "recon/nerf/rendering/render.hpp"
#include "recon/nerf/training/trainer.hpp"

namespace orbitfuse::nerf {
namespace {

double cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Time spent training, with evaluation and earlier runs accounted for.
struct Stopwatch {
  double cpu_s = 0, wall_s = 0;
  double cpu_mark = cpu_seconds(), wall_mark = wall_seconds();
  void pause() {
    cpu_s += cpu_seconds() - cpu_mark;
    wall_s += wall_seconds() - wall_mark;
  }
  void go_on() {
    cpu_mark = cpu_seconds();
    wall_mark = wall_seconds();
  }
  double wall_now() const { return wall_s + wall_seconds() - wall_mark; }
};

/// Share of the pixels whose depth has to be known for few samples to suffice in the rest (nerf.md: at 0.7 and
/// 0.64 eight are as good as 24 or better, at 0.18 they cost 4 dB).
constexpr double mostly_known = 0.5;

/// Every n-th pixel of a row and column measures: a thousand or more of an image.
int measuring_stride(const cv::Mat& image) {
  return std::clamp(static_cast<int>(std::sqrt(static_cast<double>(image.total()) / 1200)), 1, 4);
}

/// With `align`, views that measure first follow the field, which moves with the views that train.
double heldout_psnr(FieldState& field, std::vector<NormalisedView>& views, const std::vector<bool>& heldout, bool align) {
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!heldout[i]) continue;
    const int stride = measuring_stride(views[i].target);
    RenderedView picture = render_strided(field, views[i].rays, stride, {});
    for (int turn = 0; align && turn < 3; ++turn) {
      if (!take_step(sums_of(picture, stride, field.space, views[i]), field.space, field.refined_poses[i], views[i])) break;
      picture = render_strided(field, views[i].rays, stride, {});
    }
    sum += psnr_of(picture, views[i].target, stride);
    ++count;
  }
  return count > 0 ? sum / count : std::numeric_limits<double>::quiet_NaN();
}

/// Starts a field from another one's geometry: its space, density network and occupied cells. The
/// density then trains on, because a warm surface need not end where the visible one does.
Status inherit_geometry(const FieldState& guide, FieldState& state) {
  const auto differs = [&](const char* key) {
    return guide.options.get(key) != state.options.get(key);
  };
  for (const char* key : {"levels", "features_per_level", "log2_table", "base_resolution",
                          "max_resolution", "hidden", "occupancy_resolution", "sampling"})
    if (differs(key))
      return fail(ErrorKind::usage, fmt::format("nerf.{}", key),
                  fmt::format("{}, the guide field has {}", state.options.get(key),
                              guide.options.get(key)),
                  "train both fields with one architecture or set shared_geometry = false");
  state.space = guide.space;
  state.main.grid.table.value = guide.main.grid.table.value;
  state.main.mlp.weights.value = guide.main.mlp.weights.value;
  for (std::size_t k = 0; k < state.proposals.size(); ++k) {
    state.proposals[k].grid.table.value = guide.proposals[k].grid.table.value;
    state.proposals[k].mlp.weights.value = guide.proposals[k].mlp.weights.value;
  }
  state.occupancy.on = guide.occupancy.on;
  state.occupancy.density = guide.occupancy.density;
  state.occupancy.refresh();
  state.refresh();
  return {};
}

/// Names the broken views, and what is dead in the others.
void report_broken(const Dataset& dataset, const std::vector<bool>& broken, TrainReport& report) {
  int partly = 0;
  std::size_t worst = 0;
  double most = 0;
  for (std::size_t i = 0; dataset.modality == Modality::thermal && i < broken.size(); ++i) {
    const double invalid = invalid_share(dataset.views[i].image);
    if (broken[i]) {
      report.warnings.push_back(fmt::format("{} dropped: {:.0f} % of its pixels hold no temperature",
                                            dataset.views[i].name, 100 * invalid));
    } else if (invalid > 0) {
      ++partly;
      if (invalid > most) worst = i;
      most = std::max(most, invalid);
    }
  }
  if (partly > 0)
    report.skips.push_back({"dead pixels", fmt::format("no temperature, in {} of {} views, most in {}: {:.2g} %", partly,
                                                       broken.size(), dataset.views[worst].name, 100 * most),
                            "they neither train nor measure"});
}

void report_exposure(const Exposure& exposure, const Dataset& dataset, TrainReport& report) {
  const auto skip = [&](std::string why) { report.skips.push_back({"even exposure", std::move(why), "images are used as they are"}); };
  if (exposure.points == 0) return skip("no point is known to be seen by two views");
  if (!exposure.varies())
    return skip(fmt::format("views agree within {:.1f} % on {} points", 100 * exposure.spread, exposure.points));
  for (std::size_t i = 0; i < dataset.views.size(); ++i) {
    const Eigen::Array3d gain = exposure.log_gain[i].exp();
    report.image_gains[dataset.views[i].name] = {gain[0], gain[1], gain[2]};
  }
}

/// Whether held-out views at `psnr` end the run.
std::optional<StopReason> reason_to_stop(const TrainOptions& options, const Snapshot& best, double psnr) {
  if (options.target_psnr > 0 && psnr >= options.target_psnr) return StopReason::target_psnr;
  if (options.plateau_db > 0 && !best.empty() && psnr < best.psnr - options.plateau_db)
    return StopReason::plateau;
  return std::nullopt;
}

/// Progress in words: the last measured error, and the running one of the training views.
std::string errors_of(const FieldState& state) {
  const std::vector<CurvePoint>& curve = state.history.curve;
  std::string text = fmt::format("training views {:.2f} dB", state.train_psnr);
  if (!curve.empty() && std::isfinite(curve.back().heldout_psnr))
    text = fmt::format("held-out {:.2f} dB, {}", curve.back().heldout_psnr, text);
  return text;
}

}  // namespace

const char* name(StopReason reason) {
  switch (reason) {
    case StopReason::iterations: return "iterations";
    case StopReason::budget: return "budget";
    case StopReason::target_psnr: return "target PSNR";
    case StopReason::plateau: return "plateau";
    case StopReason::cancelled: return "cancelled";
  }
  return "";
}

std::string TrainReport::brief() const {
  std::string text = fmt::format("{} steps, {:.1f} CPU s", iterations, cpu_s);
  if (std::isfinite(best_psnr))
    text += fmt::format(", held-out {:.2f} dB (step {})", best_psnr, best_step);
  text += fmt::format(", {:.1f} samples a ray, stopped by {}",
                      samples_per_ray(),
                      name(stop));
  if (skipped_steps > 0) text += fmt::format(", {} steps skipped (not finite)", skipped_steps);
  return text;
}

Result<TrainReport> train(const Dataset& given, const TrainOptions& options,
                          const Progress& progress, Field& out, const Field* guide) {
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_TRY(given.validate());
  const std::string stage = fmt::format("train.{}", orbitfuse::name(given.modality));
  if (options.shared_geometry && (!guide || guide->empty()))
    return fail(ErrorKind::usage, "nerf.shared_geometry", "no guide field",
                "train the visible field first");

  TrainReport report;
  const std::vector<bool> broken = broken_views(given);
  report_broken(given, broken, report);
  const Dataset dataset = training_part(given, broken);
  if (dataset.views.empty())
    return fail(ErrorKind::input, given.views[0].name, "no view has temperatures in half of its pixels",
                "look at the frames and their radiometric scale");
  const std::vector<bool> heldout = heldout_views(dataset, options.holdout_every);
  for (std::size_t i = 0; i < heldout.size(); ++i)
    if (heldout[i]) report.heldout.push_back(dataset.views[i].name);
  const bool measuring = !report.heldout.empty();
  if (options.target_psnr > 0 && !measuring)
    return fail(ErrorKind::usage, "nerf.target_psnr", "no view is held out to measure it",
                "set nerf.holdout_every, e.g. to 8");
  if (report.heldout.size() == dataset.views.size())
    return fail(ErrorKind::usage, "nerf.holdout_every", "no view is left to train on",
                "hold out fewer views");
  const Dataset training = training_part(dataset, heldout);

  Stopwatch watch;
  auto state = std::make_unique<FieldState>();
  bool resumed = false;
  if (options.resume && std::filesystem::exists(options.checkpoint)) {
    ORBITFUSE_ASSIGN(Field loaded, Field::load(options.checkpoint));
    *state = std::move(loaded.state());
    ORBITFUSE_TRY(check_resumable(*state, dataset, records_of(dataset, heldout), options));
    state->options = options;
    if (!options.keep_best) state->best = {};
    resumed = true;
  } else {
    state->create(options, dataset.modality, static_cast<int>(dataset.views.size()));
    state->thermal_is_gray = dataset.thermal_is_gray;
    state->views = records_of(dataset, heldout);
    state->space = estimate_space(training);
    state->span = estimate_span(training);
  }
  if (state->options.haze_samples == 0)
    state->options.haze_samples = training.known_depth() >= mostly_known || options.shared_geometry ? 8 : 24;
  if (options.shared_geometry && !resumed) {
    ORBITFUSE_TRY(inherit_geometry(guide->state(), *state));
    report.skips.push_back({"density from nothing", "the visible field's geometry is given",
                            "training starts from its density and empty space"});
  }
  std::vector<NormalisedView> views = prepare_views(dataset, state->space, state->span);
  if (options.even_exposure && dataset.modality == Modality::visible) {
    const Exposure exposure = estimate_exposure(dataset, heldout);
    report_exposure(exposure, dataset, report);
    if (exposure.varies()) even_out(exposure, views);
  }
  if (!resumed && !options.shared_geometry && options.sampling == Sampling::occupancy) {
    const double left = carve(training.has_dense_depth(), views, heldout, options, state->occupancy);
    report.skips.push_back({"empty space", fmt::format("{:.1f} % of the cells seen by enough views and "
                                                       "not in front of known depth", 100 * left),
                            "rays skip the rest from the first step"});
  }
  for (std::size_t i = 0; options.refine_poses && i < views.size(); ++i) {
    if (!resumed) state->refined_poses.push_back(unmoved(dataset.views[i].cam_from_world));
    else views[i].rays = ViewRays(dataset.views[i].camera, state->refined_poses[i].pose(), state->space);
  }
  Trainer trainer(*state, views, heldout);
  History& history = state->history;
  watch.cpu_s += history.cpu_s;
  watch.wall_s += history.wall_s;
  const long earlier_rays = history.rays, earlier_samples = history.samples;

  const int evaluations = std::max(1, options.eval_count);
  const int eval_every =
      options.eval_count > 0 ? std::max(1, options.iterations / options.eval_count) : options.iterations;
  const auto fraction_now = [&] {
    const double by_time = options.budget_s > 0 ? watch.wall_now() / options.budget_s : 0;
    return std::max(by_time, static_cast<double>(state->step) / options.iterations);
  };
  double next_eval_fraction = (std::floor(fraction_now() * evaluations) + 1) / evaluations;
  double last_saved = wall_seconds();
  const auto pause = [&] {
    watch.pause();
    history.cpu_s = watch.cpu_s;
    history.wall_s = watch.wall_s;
    history.rays = earlier_rays + trainer.rays();
    history.samples = earlier_samples + trainer.samples();
  };
  const auto save = [&]() -> Status {  // while paused
    if (options.checkpoint.empty()) return {};
    last_saved = wall_seconds();
    return save_state(*state, options.checkpoint);
  };
  const auto report_progress = [&](double fraction, double wall_s) {
    progress.report({stage, fraction * options.iterations, static_cast<double>(options.iterations),
                     wall_s / std::max(1e-9, fraction) * (1 - fraction), errors_of(*state)});
  };

  /// The curve's next point, and the best field so far. Returns the held-out PSNR.
  const auto evaluate = [&](double fraction) {
    pause();
    const double psnr = heldout_psnr(*state, views, heldout, options.refine_poses && fraction > poses_move_from);
    history.curve.push_back({watch.cpu_s, watch.wall_s, state->step, psnr, state->train_psnr,
                             state->samples_per_ray});
    if (measuring && options.keep_best && (state->best.empty() || psnr > state->best.psnr))
      state->best = state->snapshot(psnr);
    report_progress(fraction, watch.wall_s);
    watch.go_on();
    return psnr;
  };

  report.stop = StopReason::iterations;
  const bool reached = options.target_psnr > 0 && !state->best.empty() && state->best.psnr >= options.target_psnr;
  if (reached) report.stop = StopReason::target_psnr;
  while (!reached && state->step < options.iterations) {
    const double fraction = fraction_now();
    if (options.budget_s > 0 && watch.wall_now() >= options.budget_s) {
      report.stop = StopReason::budget;
      // No step begins at the budget's very end, so that its last point is still to be measured.
      if (state->step > 0 && (history.curve.empty() || history.curve.back().step != state->step)) evaluate(1);
      break;
    }
    if (progress.cancelled()) {
      pause();
      ORBITFUSE_TRY(save());
      return fail(ErrorKind::cancelled, stage, fmt::format("stopped by the user at step {}", state->step),
                  options.checkpoint.empty() ? "run again" : "run again with --resume");
    }
    if (!trainer.step(fraction)) ++history.skipped_steps;

    const bool by_budget = options.budget_s > 0 && fraction >= next_eval_fraction;
    if (state->step % eval_every == 0 || by_budget || state->step == options.iterations) {
      while (fraction >= next_eval_fraction) next_eval_fraction += 1.0 / evaluations;
      const double psnr = evaluate(fraction);
      if (const auto stop = measuring ? reason_to_stop(options, state->best, psnr) : std::nullopt) {
        report.stop = *stop;
        break;
      }
    } else if (state->step % 50 == 0) {
      report_progress(fraction, watch.wall_now());
    }
    if (!options.checkpoint.empty() && wall_seconds() - last_saved > options.checkpoint_every_s) {
      pause();
      ORBITFUSE_TRY(save());
      watch.go_on();
    }
  }
  pause();
  if (history.skipped_steps > 0 && trainer.rays() > 0 && history.skipped_steps == state->step)
    return fail(ErrorKind::quality, stage,
                fmt::format("none of the {} steps had a finite gradient", history.skipped_steps),
                "look for NaN in the images or, with shared geometry, train the guide field again");
  if (state->step == 0)
    return fail(ErrorKind::usage, "nerf.budget_s", fmt::format("{} s were over before the first step", options.budget_s),
                "allow more time");
  ORBITFUSE_TRY(save());
  static_cast<History&>(report) = history;
  report.iterations = report.best_step = state->step;
  report.best_psnr = measuring && !history.curve.empty() ? history.curve.back().heldout_psnr
                                                          : std::numeric_limits<double>::quiet_NaN();
  if (!state->best.empty()) {
    report.best_step = state->best.step;
    report.best_psnr = state->best.psnr;
    state->restore(state->best);
    state->best = {};
  }
  if (options.target_psnr > 0 && !(report.best_psnr >= options.target_psnr))
    report.warnings.push_back(fmt::format("the target of {:.2f} dB was not reached: held-out {:.2f} dB",
                                          options.target_psnr, report.best_psnr));
  for (std::size_t i = 0; options.per_image_offset && i < dataset.views.size(); ++i)
    report.image_offsets_k.push_back(state->image_offsets.value[i] * (state->span.high - state->span.low));
  for (std::size_t i = 0; i < state->refined_poses.size(); ++i)
    report.refined_poses[dataset.views[i].name] = state->refined_poses[i].pose();
  // How a field came about is the report's; equal fields are equal files.
  state->history = {};
  state->options.resume = false;
  state->options.checkpoint.clear();
  out = Field(std::move(state));
  return report;
}

}  // namespace orbitfuse::nerf
