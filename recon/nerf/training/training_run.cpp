// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/training_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/system/trace.hpp"
#include "recon/nerf/device/on_device.hpp"
#include "recon/nerf/field/checkpoint.hpp"
#include "recon/nerf/rendering/render.hpp"
#include "recon/nerf/training/exposure.hpp"
#include "recon/nerf/training/measure.hpp"

namespace orbitfuse::nerf {
namespace {

/// Share of the pixels whose depth has to be known for few samples to suffice in the rest (nerf.md:
/// at 0.7 and 0.64 eight are as good as 24 or better, at 0.18 they cost 4 dB).
constexpr double mostly_known = 0.5;

/// Starts a field from another one's geometry: its space, density network and occupied cells. The
/// density then trains on, because a warm surface need not end where the visible one does.
Status inherit_geometry(const FieldState& guide, FieldState& state) {
  const auto differs = [&](const char* key) {
    return guide.options.get(key) != state.options.get(key);
  };
  for (const char* key : {"levels", "features_per_level", "log2_table", "base_resolution",
                          "max_resolution", "hidden", "occupancy_resolution", "sampling"})
    if (differs(key))
      return fail(
          ErrorKind::usage, fmt::format("nerf.{}", key),
          fmt::format("{}, the guide field has {}", state.options.get(key), guide.options.get(key)),
          "train both fields with one architecture or set shared_geometry = false");
  state.space = guide.space;
  state.main.grid.table.set_values(guide.main.grid.table.values());
  state.main.mlp.weights.value = guide.main.mlp.weights.value;
  for (std::size_t k = 0; k < state.proposals.size(); ++k) {
    state.proposals[k].grid.table.set_values(guide.proposals[k].grid.table.values());
    state.proposals[k].mlp.weights.value = guide.proposals[k].mlp.weights.value;
  }
  state.occupancy.on = guide.occupancy.on;
  state.occupancy.density = guide.occupancy.density;
  state.occupancy.refresh();
  state.refresh();
  return {};
}

void report_exposure(const Exposure& exposure, const Dataset& dataset, TrainReport& report) {
  const auto skip = [&](std::string why) {
    report.skips.push_back({"even exposure", std::move(why), "images are used as they are"});
  };
  if (exposure.points == 0) return skip("no point is known to be seen by two views");
  if (!exposure.varies())
    return skip(fmt::format("views agree within {:.1f} % on {} points", 100 * exposure.spread,
                            exposure.points));
  for (std::size_t i = 0; i < dataset.views.size(); ++i) {
    const Eigen::Array3d gain = exposure.log_gain[i].exp();
    report.image_gains[dataset.views[i].name] = {gain[0], gain[1], gain[2]};
  }
}

bool dataset_has_kelvin(const Dataset& data) {
  return data.modality == Modality::thermal && !data.thermal_is_gray;
}

/// Whether held-out views at `psnr` end the run.
std::optional<StopReason> reason_to_stop(const TrainOptions& options,
                                         const std::vector<CurvePoint>& curve, double psnr) {
  if (options.target_psnr > 0 && psnr >= options.target_psnr) return StopReason::target_psnr;
  if (options.plateau_db > 0 && psnr < peak_db(curve) - options.plateau_db)
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

Status TrainingRun::create_or_resume() {
  const Dataset& dataset = data_.dataset;
  if (options_.resume && std::filesystem::exists(options_.checkpoint)) {
    ORBITFUSE_ASSIGN(Field loaded, Field::load(options_.checkpoint));
    *state_ = std::move(loaded.state());
    ORBITFUSE_TRY(check_resumable(*state_, dataset, records_of(dataset, data_.heldout), options_));
    state_->options = options_;
    if (!options_.keep_best) state_->best = {};
    resumed_ = true;
    return {};
  }
  state_->create(options_, dataset.modality, static_cast<int>(dataset.views.size()));
  state_->thermal_is_gray = dataset.thermal_is_gray;
  state_->views = records_of(dataset, data_.heldout);
  state_->space = estimate_space(data_.training);
  if (background_) state_->space = fit_to_silhouettes(*background_, data_.training, state_->space);
  state_->span = estimate_span(data_.training);
  return {};
}

Status TrainingRun::start_geometry(const Field* guide) {
  if (state_->options.haze_samples == 0)
    state_->options.haze_samples =
        data_.training.known_depth() >= mostly_known || options_.shared_geometry ? 8 : 24;
  if (!options_.shared_geometry || resumed_) return {};
  ORBITFUSE_TRY(inherit_geometry(guide->state(), *state_));
  report_.skips.push_back({"density from nothing", "the visible field's geometry is given",
                           "training starts from its density and empty space"});
  return {};
}

void TrainingRun::prepare_views_of_run() {
  const Dataset& dataset = data_.dataset;
  views_ = prepare_views(dataset, state_->space, state_->span);
  show_background();
  if (options_.even_exposure && dataset.modality == Modality::visible) {
    const Exposure exposure = estimate_exposure(dataset, data_.heldout);
    report_exposure(exposure, dataset, report_);
    if (exposure.varies()) even_out(exposure, views_);
  }
  if (!resumed_ && !options_.shared_geometry && options_.sampling == Sampling::occupancy) {
    const double left =
        carve(data_.training.has_dense_depth(), views_, data_.heldout, options_, state_->occupancy);
    report_.skips.push_back(
        {"empty space",
         fmt::format("{:.1f} % of the cells seen by enough views and not in front of known depth",
                     100 * left),
         "rays skip the rest from the first step"});
  }
  for (std::size_t i = 0; options_.refine_poses && i < views_.size(); ++i) {
    const TrainingView& view = dataset.views[i];
    if (!resumed_)
      state_->refined_poses.push_back(unmoved(view.cam_from_world));
    else
      views_[i].rays = ViewRays(view.camera, state_->refined_poses[i].pose(), state_->space);
  }
}

void TrainingRun::show_background() {
  if (!background_) return;
  auto clearance_px = background_->clearance_px.begin();
  for (std::size_t i = 0; i < views_.size(); ++i)
    if (!data_.heldout[i]) views_[i].clearance_px = *clearance_px++;
  report_.skips.push_back({"plain background",
                           fmt::format("one colour in {:.0f} % of the pixels, from the border to "
                                       "the object",
                                       100 * background_->share),
                           "silhouettes bound the scene, one background ray in 16 is drawn"});
}

Status TrainingRun::prepare(const Field* guide) {
  background_ = find_plain_background(data_.training);
  ORBITFUSE_TRY(create_or_resume());
  ORBITFUSE_TRY(start_geometry(guide));
  prepare_views_of_run();
  if (options_.even_shading && dataset_has_kelvin(data_.dataset)) even_shading(guide);
  if (options_.even_exposure && data_.dataset.thermal_is_gray) even_levels(guide);
  try {
    trainer_.emplace(*state_, views_, data_.heldout);
    if (trainer_->on_device()) report_.device = device::current()->name();
  } catch (const device::Refused& refused) {
    report_.warnings.push_back(fmt::format("{} refused the field ({}): the processor trains it",
                                           device::current()->name(), refused.what));
    device::use(nullptr);
    trainer_.emplace(*state_, views_, data_.heldout);
  }
  const History& history = state_->history;
  watch_.cpu_s += history.cpu_s;
  watch_.wall_s += history.wall_s;
  earlier_rays_ = history.rays, earlier_samples_ = history.samples;
  last_saved_ = wall_seconds();
  return {};
}

double TrainingRun::fraction() const {
  const double by_time = options_.budget_s > 0 ? watch_.wall_now() / options_.budget_s : 0;
  return std::max(by_time, static_cast<double>(state_->step) / options_.iterations);
}

void TrainingRun::pause() {
  watch_.pause();
  History& history = state_->history;
  history.cpu_s = watch_.cpu_s;
  history.wall_s = watch_.wall_s;
  history.rays = earlier_rays_ + trainer_->rays();
  history.samples = earlier_samples_ + trainer_->samples();
}

Status TrainingRun::save() {
  if (options_.checkpoint.empty()) return {};
  trainer_->settle();
  last_saved_ = wall_seconds();
  return save_state(*state_, options_.checkpoint);
}

void TrainingRun::tell(double fraction, double wall_s) const {
  progress_.report({stage_, fraction * options_.iterations,
                    static_cast<double>(options_.iterations),
                    wall_s / std::max(1e-9, fraction) * (1 - fraction), errors_of(*state_)});
}

/// The curve's next point, and the best field so far. Returns the held-out PSNR.
double TrainingRun::evaluate(double fraction) {
  const TraceSpan span("held-out views");
  if (data_.measuring()) trainer_->settle();
  pause();
  const double psnr = heldout_psnr(*state_, views_, data_.heldout,
                                   options_.refine_poses && fraction > poses_move_from);
  state_->history.curve.push_back({watch_.cpu_s, watch_.wall_s, state_->step, psnr,
                                   state_->train_psnr, state_->samples_per_ray});
  if (data_.measuring() && options_.keep_best &&
      (state_->best.empty() || !fell(state_->history.curve)))
    state_->best = state_->snapshot(psnr);
  tell(fraction, watch_.wall_s);
  watch_.go_on();
  return psnr;
}

Result<bool> TrainingRun::step(double fraction_now) {
  if (options_.budget_s > 0 && watch_.wall_now() >= options_.budget_s) {
    report_.stop = StopReason::budget;
    // No step begins at the budget's very end, so that its last point is still to be measured.
    const std::vector<CurvePoint>& curve = state_->history.curve;
    if (state_->step > 0 && (curve.empty() || curve.back().step != state_->step)) evaluate(1);
    return false;
  }
  if (progress_.cancelled()) {
    pause();
    ORBITFUSE_TRY(save());
    return fail(ErrorKind::cancelled, stage_,
                fmt::format("stopped by the user at step {}", state_->step), "run it again");
  }
  if (!trainer_->step(fraction_now)) ++state_->history.skipped_steps;
  return true;
}

bool TrainingRun::measure_if_due(double fraction_now) {
  const int evaluations = std::max(1, options_.eval_count);
  const int every = options_.eval_count > 0 ? std::max(1, options_.iterations / options_.eval_count)
                                            : options_.iterations;
  const bool by_budget = options_.budget_s > 0 && fraction_now >= next_eval_fraction_;
  if (state_->step % every != 0 && !by_budget && state_->step != options_.iterations) {
    if (state_->step % 50 == 0) tell(fraction_now, watch_.wall_now());
    return false;
  }
  while (fraction_now >= next_eval_fraction_) next_eval_fraction_ += 1.0 / evaluations;
  const double psnr = evaluate(fraction_now);
  if (!data_.measuring()) return false;
  const auto stop = reason_to_stop(options_, state_->history.curve, psnr);
  if (stop) report_.stop = *stop;
  return stop.has_value();
}

Status TrainingRun::loop() {
  const Snapshot& best = state_->best;
  if (options_.target_psnr > 0 && !best.empty() && best.psnr >= options_.target_psnr) {
    report_.stop = StopReason::target_psnr;
    pause();
    return save();
  }
  const int evaluations = std::max(1, options_.eval_count);
  next_eval_fraction_ = (std::floor(fraction() * evaluations) + 1) / evaluations;
  while (state_->step < options_.iterations) {
    const double now = fraction();
    ORBITFUSE_ASSIGN(const bool stepped, step(now));
    if (!stepped || measure_if_due(now)) break;
    if (!options_.checkpoint.empty() &&
        wall_seconds() - last_saved_ > options_.checkpoint_every_s) {
      pause();
      ORBITFUSE_TRY(save());
      watch_.go_on();
    }
  }
  trainer_->settle();
  pause();
  const int skipped = state_->history.skipped_steps;
  if (skipped > 0 && trainer_->rays() > 0 && skipped == state_->step)
    return fail(ErrorKind::quality, stage_,
                fmt::format("none of the {} steps had a finite gradient", skipped),
                "look for NaN in the images or, with shared geometry, train the guide field again");
  if (state_->step == 0)
    return fail(ErrorKind::usage, "nerf.budget_s",
                fmt::format("{} s were over before the first step", options_.budget_s),
                "allow more time");
  return save();
}

Status TrainingRun::save_after_refusal() {
  if (!trainer_) return {};
  pause();
  try {
    return save();
  } catch (const device::Refused&) {
    return {};  // steps since the last checkpoint are lost
  }
}

Result<Field> TrainingRun::finish() {
  static_cast<History&>(report_) = state_->history;
  report_.iterations = report_.best_step = state_->step;
  report_.best_psnr = data_.measuring() && !report_.curve.empty()
                          ? report_.curve.back().heldout_psnr
                          : std::numeric_limits<double>::quiet_NaN();
  if (!state_->best.empty()) {
    report_.best_step = state_->best.step;
    report_.best_psnr = state_->best.psnr;
    state_->restore(state_->best);
    state_->best = {};
  }
  if (options_.target_psnr > 0 && !(report_.best_psnr >= options_.target_psnr))
    report_.warnings.push_back(
        fmt::format("the target of {:.2f} dB was not reached: held-out {:.2f} dB",
                    options_.target_psnr, report_.best_psnr));
  const std::vector<TrainingView>& views = data_.dataset.views;
  for (std::size_t i = 0; options_.per_image_offset && i < views.size(); ++i)
    report_.image_offsets_k[views[i].name] =
        state_->image_offsets.value[i] * (state_->span.high - state_->span.low);
  for (std::size_t i = 0; i < state_->refined_poses.size(); ++i)
    report_.refined_poses[views[i].name] = state_->refined_poses[i].pose();
  // How a field came about is the report's; equal fields are equal files.
  state_->history = {};
  state_->options.resume = false;
  state_->options.checkpoint.clear();
  return Field(std::move(state_));
}

}  // namespace orbitfuse::nerf
