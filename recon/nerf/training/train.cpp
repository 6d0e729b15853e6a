// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>

#include "core/system/trace.hpp"
#include "recon/nerf/device/on_device.hpp"
#include "recon/nerf/nerf.hpp"
#include "recon/nerf/training/training_run.hpp"

namespace orbitfuse::nerf {
namespace {

/// Names the broken views, and what is dead in the others.
void report_broken(const Dataset& dataset, const std::vector<bool>& broken, TrainReport& report) {
  int partly = 0;
  std::size_t worst = 0;
  double most = 0;
  for (std::size_t i = 0; dataset.modality == Modality::thermal && i < broken.size(); ++i) {
    const double invalid = invalid_share(dataset.views[i].image);
    if (broken[i]) {
      report.warnings.push_back(
          fmt::format("{} dropped: {:.0f} % of its pixels hold no temperature",
                      dataset.views[i].name, 100 * invalid));
    } else if (invalid > 0) {
      ++partly;
      if (invalid > most) worst = i;
      most = std::max(most, invalid);
    }
  }
  if (partly > 0)
    report.skips.push_back(
        {"dead pixels",
         fmt::format("no temperature, in {} of {} views, most in {}: {:.2g} %", partly,
                     broken.size(), dataset.views[worst].name, 100 * most),
         "they neither train nor measure"});
}

}  // namespace

const char* name(StopReason reason) {
  switch (reason) {
    case StopReason::iterations:
      return "iterations";
    case StopReason::budget:
      return "budget";
    case StopReason::target_psnr:
      return "target PSNR";
    case StopReason::plateau:
      return "plateau";
    case StopReason::cancelled:
      return "cancelled";
  }
  return "";
}

std::string TrainReport::brief() const {
  std::string text = fmt::format("{} steps, {:.1f} CPU s", iterations, cpu_s);
  if (std::isfinite(best_psnr))
    text += fmt::format(", held-out {:.2f} dB (step {})", best_psnr, best_step);
  text += fmt::format(", {:.1f} samples a ray, stopped by {}", samples_per_ray(), name(stop));
  if (shading_k != 0)
    text += fmt::format(", without the lens' shading ({:+.2f} K at the sides)", shading_k);
  if (skipped_steps > 0) text += fmt::format(", {} steps skipped (not finite)", skipped_steps);
  return text;
}

namespace {

Result<TrainingData> split(const Dataset& given, const TrainOptions& options, TrainReport& report) {
  const std::vector<bool> broken = broken_views(given);
  report_broken(given, broken, report);
  TrainingData data;
  data.dataset = training_part(given, broken);
  if (data.dataset.views.empty())
    return fail(ErrorKind::input, given.views[0].name,
                "no view has temperatures in half of its pixels",
                "look at the frames and their radiometric scale");
  data.heldout = heldout_views(data.dataset, options.holdout_every);
  for (std::size_t i = 0; i < data.heldout.size(); ++i)
    if (data.heldout[i]) report.heldout.push_back(data.dataset.views[i].name);
  if (options.target_psnr > 0 && report.heldout.empty())
    return fail(ErrorKind::usage, "nerf.target_psnr", "no view is held out to measure it",
                "set nerf.holdout_every, e.g. to 8");
  if (report.heldout.size() == data.dataset.views.size())
    return fail(ErrorKind::usage, "nerf.holdout_every", "no view is left to train on",
                "hold out fewer views");
  data.training = training_part(data.dataset, data.heldout);
  return data;
}

}  // namespace

Result<TrainReport> train(const Dataset& given, const TrainOptions& options,
                          const Progress& progress, Field& out, const Field* guide) {
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_TRY(given.validate());
  if (options.shared_geometry && (!guide || guide->empty()))
    return fail(ErrorKind::usage, "nerf.shared_geometry", "no guide field",
                "train the visible field first");
  TrainReport report;
  ORBITFUSE_ASSIGN(const TrainingData data, split(given, options, report));
  TrainingRun run(data, options, progress, report);
  try {
    {
      const TraceSpan span("prepare training");
      ORBITFUSE_TRY(run.prepare(guide));
    }
    const TraceSpan span("training steps");
    ORBITFUSE_TRY(run.loop());
  } catch (const device::Refused& refused) {
    ORBITFUSE_TRY(run.save_after_refusal());
    return tl::unexpected(device::error_of(refused));
  }
  ORBITFUSE_ASSIGN(out, run.finish());
  return report;
}

}  // namespace orbitfuse::nerf
