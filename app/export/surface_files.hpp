// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/export/export_frame.hpp"
#include "app/view/finished_run.hpp"
#include "recon/assembly/field_surface.hpp"

namespace orbitfuse::exporting {

enum class Crop {
  object,  ///< what the cameras look at
  box,     ///< as given
  whole,   ///< all that the cameras surround, and as much again
};

struct SurfaceRequest {
  Crop crop = Crop::object;
  Eigen::AlignedBox3d box;  ///< of Crop::box, in the run's world
  FieldSurfaceOptions surface;
};

/// Errors: field_surface's, object_box's; usage (Crop::box holds no surface; says where it is).
Result<FieldSurface> surface_of_run(const view::FinishedRun& run, const SurfaceRequest& request,
                                    const Progress& progress);

/// What a surface is made of and how, apart from how many triangles it is reduced to. Empty where
/// the run's identity is not known.
std::string surface_key(const view::FinishedRun& run, const SurfaceRequest& request);

enum class VertexColors { visible, temperature };

struct FileOptions {
  VertexColors colors = VertexColors::visible;
  std::string palette = "inferno";
  std::string temperature_name = "temperature";  ///< of PLY (PlyWriteOptions)
  bool points = false;                           ///< PLY without faces
  std::string made_of;                           ///< surface_key(), for the sidecar
};

/// In the run's folder, where none is named.
inline constexpr const char* default_surface_file = "export/surface.glb";

/// One file in the format of its extension (.glb, .ply, .obj, .las) and FILE.json beside it, which
/// says the frame and what is missing. Errors: usage (another extension, colours by temperature
/// where there is none), the writers'.
Status write_surface(const std::filesystem::path& file, const view::FinishedRun& run,
                     const FieldSurface& surface, const ExportFrame& frame,
                     const FileOptions& options);

/// Whether something lies at the file's place, or its sidecar's, that no finished write_surface()
/// left there: a user's own, or an export that was worked on since.
bool holds_other_work(const std::filesystem::path& file);

/// In lower case: A.GLB is a .glb.
std::string extension_of(const std::filesystem::path& file);

/// Before anything takes its time: whether write_surface knows the extension. Errors: usage.
Status check_extension(const std::filesystem::path& file);

}  // namespace orbitfuse::exporting
