// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/poses/estimate_poses.hpp"
#include "tests/support/orbit_scenes.hpp"

namespace orbitfuse::scenes {

/// How far apart the two modalities of a rendered pair lie, against the truth. A field shows what
/// its views near the new camera saw: a scene point's pixel in a true view is put back into the
/// scene along the believed view, at the rendered depth, and seen from the new camera; the mean
/// over the three nearest views is what this modality shows of it. Pixels of a 640 wide image, over
/// all test views and every rendered pixel with depth.
struct Misalignment {
  std::vector<double> px;
};
Result<Misalignment> misalignment(const Scene& scene, const Reconstruction& visible,
                                  const Reconstruction& thermal, const SceneRenderer& renderer);

}  // namespace orbitfuse::scenes
