// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "app/comparison/comparison.hpp"

namespace orbitfuse::comparison {

/// Both runs, AFTER's scale where it is known, and what was found.
struct ComparedRuns {
  const view::FinishedRun& before;
  const view::FinishedRun& after;
  std::optional<stages::MetricScale> scale;
  const Comparison& comparison;
};

/// What differences.json holds (docs/formats.md).
nlohmann::json to_json(const ComparedRuns& runs);

/// Into `folder`: differences.json; difference.ply (scalar difference_k, NaN where nothing is said)
/// and difference.glb, coloured blue (colder) over white to red (warmer), changed geometry magenta,
/// what was not compared gray; views/NAME.png, the same over pictures of AFTER from its own visible
/// cameras; comparison.html, one page that needs nothing else. Errors: the renderer's, the writers'.
Status write_comparison(const std::filesystem::path& folder, const ComparedRuns& runs,
                        const CompareOptions& options, const Progress& progress);

}  // namespace orbitfuse::comparison
