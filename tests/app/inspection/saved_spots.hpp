// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "recon/measurement/answer.hpp"
#include "recon/measurement/measurement_file.hpp"

namespace orbitfuse::inspection {

/// A spot that three frames saw, 0.3 K sure, as it is saved.
inline measurement::SavedMeasurement spot_at(const std::string& name, double kelvin) {
  measurement::Answer answer;
  answer.position = Eigen::Vector3d(0.1, 0.2, 0.3);
  measurement::TemperatureReading& r = answer.reading;
  r.temperature_k = r.mean_k = kelvin;
  r.min_k = kelvin - 0.2;
  r.max_k = kelvin + 0.2;
  r.uncertainty_k = 0.3;
  r.field_k = kelvin + 0.1;
  r.spread_k = 0.15;
  r.angle_deg = 25;
  r.seen_points = 1;
  r.seen_share = 1;
  for (const char* frame : {"thermal/000000.tiff", "thermal/000001.tiff", "thermal/000002.tiff"})
    r.frames.push_back({.frame = frame,
                        .pixel = {48, 36},
                        .mean_k = kelvin,
                        .min_k = kelvin,
                        .max_k = kelvin,
                        .angle_deg = 25,
                        .pixels_per_unit = 100,
                        .weight = 1.0 / 3});
  answer.radiometry.words = "emissivity 0.95, as recorded";
  measurement::SavedMeasurement saved;
  saved.name = name;
  saved.created = "2026-11-22T16:00:00Z";
  saved.request.places = {*answer.position};
  saved.answer = to_json(answer);
  return saved;
}

/// A place that no frame saw.
inline measurement::SavedMeasurement unseen_spot(const std::string& name) {
  measurement::SavedMeasurement saved = spot_at(name, 300);
  measurement::Answer answer;
  answer.position = Eigen::Vector3d(0.1, 0.2, 0.3);
  answer.reading.field_k = 299;
  answer.reading.hidden = "12 occluded";
  answer.notes = {"no thermal frame sees it (12 occluded)"};
  saved.answer = to_json(answer);
  return saved;
}

}  // namespace orbitfuse::inspection
