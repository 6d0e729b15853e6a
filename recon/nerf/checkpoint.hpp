// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "recon/nerf/dataset.hpp"
#include "recon/nerf/field_state.hpp"

namespace orbitfuse::nerf {

/// Everything that training needs to go on, written atomically.
Status save_state(const FieldState& state, const std::filesystem::path& path);
Result<FieldState> load_state(const std::filesystem::path& path);

/// A checkpoint continues only the dataset and architecture it was made with; names what differs.
Status check_resumable(const FieldState& state, const Dataset& dataset, const TrainOptions& options);

}  // namespace orbitfuse::nerf
