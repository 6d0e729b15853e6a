// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "app/farm/job_outcome.hpp"

namespace orbitfuse::farm {

/// One session's row: how far it is, what came out, what it cost.
struct SessionOverview {
  std::string name;
  JobState state = JobState::waiting;
  std::string stage;  ///< where it stands; empty when all are done
  std::string cause;  ///< of failed and interrupted
  int done = 0, starts = 0;
  double cpu_s = 0, wall_s = 0, memory_mb = 0;
  std::optional<double> posed_visible, posed_thermal;      ///< share of the views
  std::optional<double> doubtful_thermal;                  ///< views
  std::optional<double> psnr_visible_db, psnr_thermal_db;  ///< held-out views
  std::optional<double> qabf_best;                         ///< of the fusion `best`
  bool report = false;
};

std::vector<SessionOverview> look_at_sessions(const std::filesystem::path& out,
                                              const FarmPlan& plan);
std::string to_csv(const std::vector<SessionOverview>& sessions);
/// One self-contained page; links lead to the sessions' reports beside it.
std::string to_html(const std::vector<SessionOverview>& sessions, const FarmPlan& plan);
/// farm.csv and farm.html.
Status write_overview(const std::filesystem::path& out, const FarmPlan& plan,
                      const std::vector<SessionOverview>& sessions);

}  // namespace orbitfuse::farm
