// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/measurement/answer.hpp"
#include "recon/measurement/thermal_scene.hpp"

namespace orbitfuse::measurement {

/// Answers a request from the field and from every original frame that sees the place. What no
/// frame sees has no temperature_k, and a note that says so. Several threads may ask at once.
/// Errors: usage (the request), input (a view or place that isn't there, a point outside of the
/// scene, a frame that can't be read), cancelled.
Result<Answer> measure(const ThermalScene& scene, const Request& request, const Progress& progress);

/// The request to keep: pixels of spots, lines and distances become the points that they showed,
/// because a view's name may stand for another camera when the run renders anew. Polygons stay. A
/// distance between kept points is the same; it is as sure as points are, not as its pixels were.
Request anchored(Request request, const Answer& answer);

/// A measurement to keep: the anchored() request, and what it answers. Of spots that is not quite
/// what their pixels answered, whose view alone gave the surface's normal: asked again, or as a
/// part of a difference, what is kept gives the same figures. Errors: as measure().
struct Anchored {
  Request request;
  Answer answer;
};
Result<Anchored> measure_anchored(const ThermalScene& scene, const Request& request,
                                  const Progress& progress);

/// The surface at a place: of a point, with the normal that the frames which see it agree on and a
/// NaN field_k where none does. Errors: as measure().
Result<SurfacePoint> surface_of(const ThermalScene& scene, const Place& place,
                                const Progress& progress);

}  // namespace orbitfuse::measurement
