// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "drivers/synthetic/scene.hpp"

namespace orbitfuse::synthetic {

/// Linear RGB radiance, about 0..1: sun with hard shadows, sky light, gloss and mirrored sky that
/// move with the viewer.
Eigen::Vector3d visible_radiance(const Scene& scene, const Ray& ray, const Hit& hit);

/// Surface temperature in kelvin, the same from every side: smooth and nearly without texture, as
/// heat spreads within a body; edges are where bodies meet.
double temperature_k(const Scene& scene, const Ray& ray, const Hit& hit);

}  // namespace orbitfuse::synthetic
