// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.hpp"
#include "core/system/clock.hpp"
#include "recon/nerf/field/field_state.hpp"
#include "recon/nerf/nerf.hpp"
#include "recon/nerf/training/plain_background.hpp"
#include "recon/nerf/training/trainer.hpp"

namespace orbitfuse::nerf {

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

/// Data of one run: what trains, what measures, what was dropped.
struct TrainingData {
  Dataset dataset;            ///< without broken views
  std::vector<bool> heldout;  ///< of its views
  Dataset training;           ///< what training may know
  bool measuring() const { return training.views.size() < dataset.views.size(); }
};

/// A field and its views on the way from the first step (or a checkpoint's) to the last.
class TrainingRun {
 public:
  TrainingRun(const TrainingData& data, const TrainOptions& options, const Progress& progress,
              TrainReport& report)
      : data_(data),
        options_(options),
        progress_(progress),
        report_(report),
        stage_(fmt::format("train.{}", orbitfuse::name(data.dataset.modality))) {}

  /// The field from nothing, from the guide's geometry or from its checkpoint, and the views.
  Status prepare(const Field* guide);
  /// Steps until something ends them; report.stop says what.
  Status loop();
  /// After a device has refused to go on: writes the checkpoint, if it still gives back the field.
  Status save_after_refusal();
  /// The best parameters, and the report.
  Result<Field> finish();

 private:
  Status create_or_resume();
  Status start_geometry(const Field* guide);
  void prepare_views_of_run();
  void even_shading(const Field* guide);
  void even_levels(const Field* guide);
  void show_background();  ///< to the views that train

  double fraction() const;  ///< place in the schedule
  void pause();
  Status save();  ///< while paused
  double evaluate(double fraction);
  void tell(double fraction, double wall_s) const;
  Result<bool> step(double fraction);    ///< false: the budget ended the run before it
  bool measure_if_due(double fraction);  ///< true: what it measured ends the run

  const TrainingData& data_;
  const TrainOptions& options_;
  const Progress& progress_;
  TrainReport& report_;
  const std::string stage_;
  Stopwatch watch_;
  std::unique_ptr<FieldState> state_ = std::make_unique<FieldState>();
  bool resumed_ = false;
  std::optional<PlainBackground> background_;
  std::vector<NormalisedView> views_;
  std::optional<Trainer> trainer_;
  long earlier_rays_ = 0, earlier_samples_ = 0;
  double next_eval_fraction_ = 0, last_saved_ = 0;
};

}  // namespace orbitfuse::nerf
