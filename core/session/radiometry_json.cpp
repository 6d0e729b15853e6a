// SPDX-License-Identifier: BSD-3-Clause
#include <array>

#include "core/session/manifest_json.hpp"

namespace orbitfuse::manifest {
namespace {

/// The fields by their names in the manifest, in one place for both ways.
template <class Calibration, class Visit>
void visit_fields(Calibration& c, Visit visit) {
  visit("planck_r1", c.planck.r1);
  visit("planck_r2", c.planck.r2);
  visit("planck_b", c.planck.b);
  visit("planck_f", c.planck.f);
  visit("planck_o", c.planck.o);
  visit("alpha1", c.atmosphere.alpha1);
  visit("alpha2", c.atmosphere.alpha2);
  visit("beta1", c.atmosphere.beta1);
  visit("beta2", c.atmosphere.beta2);
  visit("x", c.atmosphere.x);
  visit("emissivity", c.object.emissivity);
  visit("distance_m", c.object.distance_m);
  visit("reflected_k", c.object.reflected_k);
  visit("atmospheric_k", c.object.atmospheric_k);
  visit("window_k", c.object.window_k);
  visit("window_transmission", c.object.window_transmission);
  visit("relative_humidity", c.object.relative_humidity);
}

}  // namespace

Json json_of_radiometry(const FlirCalibration& calibration) {
  Json json = Json::object();
  visit_fields(calibration, [&](const char* key, const double& value) { json[key] = value; });
  return json;
}

Result<FlirCalibration> read_radiometry(const JsonFields& fields) {
  FlirCalibration calibration;
  Status status;
  visit_fields(calibration, [&](const char* key, double& value) {
    if (status) status = fields.get(key, value);
  });
  ORBITFUSE_TRY(status);
  ORBITFUSE_TRY(calibration.validate(fields.place()));
  return calibration;
}

}  // namespace orbitfuse::manifest
