// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "core/result.hpp"
#include "recon/nerf/device/engine.hpp"
#include "recon/nerf/field/device_copy.hpp"
#include "recon/nerf/field/field_state.hpp"

// Between what the processor holds (Eigen, GridTable) and a device's plain numbers.
namespace orbitfuse::nerf::device {

/// What computes in place of the processor, of the whole process; null: nothing does.
Engine* current();
/// Takes its place from here on; null: the processor again. Before anything runs, as
/// set_thread_count().
void use(std::unique_ptr<Engine> engine);

/// What rendering takes of a field.
FieldNumbers shown_numbers(const FieldState& field);
/// With what only training needs: moments, offsets, the cells' densities.
FieldNumbers all_numbers(const FieldState& field);
/// Parameters, moments and occupancy; derived layouts follow.
void take_back(FieldNumbers numbers, FieldState& field);

Error error_of(const Refused& refused);

}  // namespace orbitfuse::nerf::device
