// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "app/farm/job_outcome.hpp"
#include "app/farm/needs.hpp"
#include "core/progress.hpp"

namespace orbitfuse::farm {

struct LocalLimits {
  int workers = 0;       ///< stages at a time at most; 0: as many as cores and memory admit
  int cores = 0;         ///< 0: all of this machine
  double memory_mb = 0;  ///< 0: what is free now, less a tenth
  /// Stages at a time that compute on the GPU. Each takes the first one, most of whose memory a
  /// training of default size may need.
  int gpu_jobs = 1;
  Status validate() const;
};

/// Whether each stage that is not done keeps within the limits that were given; a stage larger than
/// a machine that nobody limited runs alone. Errors: usage.
Status check_limits(const std::filesystem::path& out, const FarmPlan& plan,
                    const LocalLimits& limits);

using OnOutcome =
    std::function<void(const FarmSession&, const std::string& stage, const JobOutcome&)>;

/// Runs what is not done of every session on this machine. A session's failure never stops another.
/// Errors: cancelled, device (the farm's own records can't be written); running stages are asked to
/// stop first and keep their checkpoints.
Status run_local(const std::filesystem::path& out, const FarmPlan& plan, const LocalLimits& limits,
                 const OnOutcome& on_outcome, const Progress& progress);

}  // namespace orbitfuse::farm
