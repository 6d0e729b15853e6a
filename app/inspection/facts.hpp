// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/inspection/details.hpp"
#include "app/inspection/findings.hpp"
#include "app/report/report_model.hpp"
#include "app/view/finished_run.hpp"
#include "core/session/session.hpp"

// What a report says beside its findings, as lines of (what, value). What nobody recorded says so.
namespace orbitfuse::inspection {

inline constexpr const char* not_recorded = "not recorded";

report::Facts cover_facts(const InspectionDetails& details);
/// Cameras by model and serial number, and when each orbit was recorded.
report::Facts camera_facts(const Session& session, const InspectionDetails& details);
report::Facts condition_facts(const InspectionDetails& details);
/// What the temperatures were made with, and what the operator says of it.
report::Facts radiometry_facts(const Session& session, const InspectionDetails& details);

/// What the result can't say, a sentence each: views without a pose or with a doubtful one, what no
/// frame saw, an uncalibrated camera, parameters that nobody recorded.
std::vector<std::string> limits_of(const Session& session, const view::FinishedRun& run,
                                   const InspectionDetails& details,
                                   const std::vector<InspectionFinding>& findings);

}  // namespace orbitfuse::inspection
