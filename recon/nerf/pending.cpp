// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/nerf.hpp"

namespace orbitfuse::nerf {
namespace {
auto pending() { return fail(ErrorKind::unavailable, "nerf", "being written", "merge main later"); }
}  // namespace

Result<Field> Field::load(const std::filesystem::path&) { return pending(); }
Status Field::save(const std::filesystem::path&) const { return pending(); }
Result<TrainReport> train(const Dataset&, const TrainOptions&, const Progress&, Field&,
                          const Field*) {
  return pending();
}
Result<RenderedView> render(const Field&, const Camera&, const Rigid3d&, const RenderOptions&,
                            const Progress&) {
  return pending();
}
Result<PointCloud> export_point_cloud(const Field&, const std::vector<PosedView>&,
                                      const ExportOptions&, const Progress&) {
  return pending();
}
std::string TrainReport::brief() const { return {}; }
const char* name(StopReason) { return ""; }
Status RenderOptions::validate() const { return {}; }
Status ExportOptions::validate() const { return {}; }

}  // namespace orbitfuse::nerf
