// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "app/inspection/details.hpp"
#include "app/inspection/inspection_html.hpp"
#include "app/stages/run_config.hpp"
#include "core/session/session.hpp"

namespace orbitfuse::inspection {

inline constexpr const char* inspection_file = "inspection.html";
inline constexpr const char* inspection_pdf_file = "inspection.pdf";

/// The inspection report of a finished run: its saved measurements as findings, with what `details`
/// says. Errors: input (no finished run, another session, measurements that are damaged or of
/// another run), usage (findings_of), cancelled.
Result<InspectionModel> inspection_of(const std::filesystem::path& out, const Session& session,
                                      const InspectionDetails& details,
                                      const stages::RunConfig& config, const Progress& progress);

}  // namespace orbitfuse::inspection
