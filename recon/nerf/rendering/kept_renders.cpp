// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/kept_renders.hpp"

namespace orbitfuse::nerf {
namespace {

bool same(const Rigid3d& a, const Rigid3d& b) {
  return a.rotation.coeffs() == b.rotation.coeffs() && a.translation == b.translation;
}

std::size_t bytes_of(const RenderedView& view) {
  return (view.color.total() * static_cast<std::size_t>(view.color.channels()) +
          view.depth.total() + view.opacity.total()) *
         sizeof(float);
}

}  // namespace

Result<RenderedView> render_where_it_stands(const Field& field, const PosedView& view,
                                            const Camera& camera, KeptRenders* kept,
                                            const Progress& progress) {
  if (kept != nullptr)
    if (const auto known = kept->by_name.find(view.name);
        known != kept->by_name.end() && known->second.camera == camera &&
        same(known->second.cam_from_world, view.cam_from_world))
      return known->second.seen;
  ORBITFUSE_ASSIGN(RenderedView seen,
                   render(field, camera, view.cam_from_world, where_views_stand, progress));
  if (kept == nullptr) return seen;
  if (const auto other = kept->by_name.find(view.name); other != kept->by_name.end()) {
    kept->bytes -= bytes_of(other->second.seen);
    kept->by_name.erase(other);
  }
  if (kept->bytes + bytes_of(seen) > kept->most_bytes) return seen;
  kept->bytes += bytes_of(seen);
  kept->by_name.emplace(view.name, KeptRenders::Kept{camera, view.cam_from_world, seen});
  return seen;
}

}  // namespace orbitfuse::nerf
