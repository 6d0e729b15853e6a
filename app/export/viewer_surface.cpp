// SPDX-License-Identifier: BSD-3-Clause
#include "app/export/viewer_surface.hpp"

#include <algorithm>
#include <optional>

#include "app/export/glb.hpp"
#include "app/export/surface_files.hpp"
#include "app/stages/artifacts.hpp"
#include "app/view/surface.hpp"
#include "core/geometry/geometry_json.hpp"
#include "core/system/file_io.hpp"
#include "recon/surface/surface.hpp"

namespace orbitfuse::exporting {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;

/// Before the bytes: of what they are made, and their own hash.
std::string head_of(const std::string& key, std::string_view bytes) {
  return "orbitfuse view surface 2 " + key + " " + content_hash(bytes) + "\n";
}

std::optional<std::string> kept_in(const fs::path& file, const std::string& key) {
  const auto all = read_file(file);
  const std::size_t head = head_of(key, {}).size();
  if (!all || all->size() < head) return std::nullopt;
  std::string bytes = all->substr(head);
  if (all->substr(0, head) != head_of(key, bytes)) return std::nullopt;
  return bytes;
}

/// The surface of the run's export in the run's world; nothing where that one is another, coarser
/// or gone.
std::optional<TriangleMesh> exported(const fs::path& file, const std::string& key) {
  const auto about = stages::read_json(file.string() + ".json");
  const auto hash = file_hash(file);
  if (!about || !hash || !about->is_object() || about->value("made_of", json()) != key ||
      about->value("file_hash", json()) != *hash || about->value("colors", json()) != "visible")
    return std::nullopt;
  const JsonFields fields(*about, "", {});
  int triangles = 0, fused = 0;
  if (!fields.get_all("triangles", triangles, "fused_triangles", fused) ||
      triangles < std::min(fused, viewer_triangles))
    return std::nullopt;
  const auto world_from_export = matrix_of_json(about->value("world_from_export", json()));
  auto mesh = read_glb(file);
  if (!world_from_export || !mesh) return std::nullopt;
  for (Eigen::Vector3d& p : mesh->vertices.positions)
    p = (*world_from_export * p.homogeneous()).head<3>();
  return simplified(*mesh, viewer_triangles);
}

}  // namespace

Result<std::string> viewer_surface(const view::FinishedRun& run, const Progress& progress) {
  SurfaceRequest request;
  request.surface.surface.triangles = viewer_triangles;
  const std::string key = surface_key(run, request);
  const fs::path file = run.out / viewer_surface_file;
  std::optional<TriangleMesh> mesh;
  if (!key.empty()) {
    if (auto kept = kept_in(file, key)) return *std::move(kept);
    mesh = exported(run.out / default_surface_file, key);
  }
  if (!mesh) {
    ORBITFUSE_ASSIGN(FieldSurface made, surface_of_run(run, request, progress));
    mesh = std::move(made.mesh);
  }
  const std::string bytes =
      view::packed(*mesh) + view::packed(simplified(*mesh, viewer_triangles_moving));
  // A folder that can only be read from is shown all the same, if later.
  if (!key.empty()) static_cast<void>(write_file_atomic(file, head_of(key, bytes) + bytes));
  return bytes;
}

}  // namespace orbitfuse::exporting
