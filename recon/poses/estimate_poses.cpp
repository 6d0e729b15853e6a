// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate_poses.hpp"

namespace orbitfuse {
namespace {

tl::unexpected<Error> not_here(const char* where) {
  return fail(ErrorKind::unavailable, where, "not implemented in this build", "update the build");
}

}  // namespace

Result<ModalityPoses> estimate_visible_poses(const Session&, const PoseOptions& options,
                                             const std::filesystem::path&, const Progress&) {
  ORBITFUSE_TRY(options.validate());
  return not_here("poses.visible");
}

Result<ThermalPoses> estimate_thermal_poses(const Session&, const VisibleScene*,
                                            const PoseOptions& options,
                                            const std::filesystem::path&, const Progress&) {
  ORBITFUSE_TRY(options.validate());
  return not_here("poses.thermal");
}

}  // namespace orbitfuse
