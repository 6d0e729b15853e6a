// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "recon/nerf/dataset.hpp"
#include "recon/nerf/field/field_state.hpp"

namespace orbitfuse::nerf {

/// Everything that training needs to go on, written atomically.
Status save_state(const FieldState& state, const std::filesystem::path& path);
Result<FieldState> load_state(const std::filesystem::path& path);

std::vector<ViewRecord> records_of(const Dataset& dataset, const std::vector<bool>& heldout);

/// A checkpoint goes on only with the data and the options that give its parameters their meaning;
/// the error names the first that differs.
Status check_resumable(const FieldState& state, const Dataset& dataset,
                       const std::vector<ViewRecord>& views, const TrainOptions& options);

}  // namespace orbitfuse::nerf
