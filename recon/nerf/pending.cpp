// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/nerf.hpp"

namespace orbitfuse::nerf {
namespace {
auto pending() { return fail(ErrorKind::unavailable, "nerf", "being written", "merge main later"); }
}  // namespace

Result<PointCloud> export_point_cloud(const Field&, const std::vector<PosedView>&,
                                      const ExportOptions&, const Progress&) {
  return pending();
}
Status ExportOptions::validate() const { return {}; }

}  // namespace orbitfuse::nerf
