// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "app/view/finished_run.hpp"

namespace orbitfuse::exporting {

/// What a phone draws at 30 pictures a second.
inline constexpr int viewer_triangles = 60'000;
/// What two cores without a graphics processor draw at 30 pictures a second (docs/notes/view.md).
inline constexpr int viewer_triangles_moving = 8'000;
/// In the run's folder.
inline constexpr const char* viewer_surface_file = "view/surface.bin";

/// The run's surface for its viewer, in the bytes of view::packed(), and after it the coarser one
/// for while the camera moves on a slow machine: as it was kept, or taken from
/// the run's export where that one has the same and as many triangles, or made, and then kept. What
/// was made of other fields, or is damaged, is made anew. A folder that can't be written to is no
/// error. Errors: surface_of_run's.
Result<std::string> viewer_surface(const view::FinishedRun& run, const Progress& progress);

}  // namespace orbitfuse::exporting
