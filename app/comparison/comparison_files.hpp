// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/comparison/comparison_pictures.hpp"

namespace orbitfuse::comparing {

/// What differences.json holds: runs, registration, what was taken out, regions. Schema 1; lengths
/// in metres where the scale is known, else in AFTER's unit ("unit" says which), places in AFTER's
/// world in its unit.
nlohmann::json to_json(const ComparedRuns& runs);

/// difference.glb, difference.ply, differences.json, views/*.jpg and compare.html, the page last.
/// Errors: device, the writers'.
Status write_comparison(const std::filesystem::path& folder, const ComparedRuns& runs,
                        const std::vector<ComparisonPictures>& pictures);

/// One self-contained page. What to read first: what differs, then how sure it is.
std::string to_html(const ComparedRuns& runs, const std::vector<ComparisonPictures>& pictures);

/// A region's area, "0.52 m²" or in units.
std::string area_words(const ComparedRuns& runs, double area);
/// How far the surfaces lie apart where nothing changed, "3.1 mm (0.06 % of the extent)".
std::string residual_words(const ComparedRuns& runs);
/// What was taken out, or not.
std::string ambient_words(const ComparedRuns& runs);

}  // namespace orbitfuse::comparing
