// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "app/report/report_model.hpp"
#include "core/session/session.hpp"
#include "recon/measurement/answer.hpp"
#include "recon/measurement/measurement_file.hpp"

namespace orbitfuse::stages {

/// One place of an answer that has a temperature of its own.
struct ReadPlace {
  std::string name;  ///< of the measurement, with a number where it has several places
  const measurement::TemperatureReading* reading = nullptr;
  std::optional<Eigen::Vector3d> position;
  std::string notes;  ///< what is to be known beside the figures
};

/// The places of an answer, which must outlive them: of hottest and coldest each, of a difference
/// both. A distance has none.
std::vector<ReadPlace> places_of(const std::string& name, const measurement::Answer& answer);

/// "36.1", empty where it is not known.
std::string celsius_words(double kelvin, int digits = 1);
/// As above for differences.
std::string number_words(double value, int digits = 1);

/// The measurements that are saved in a run's folder. No measurements, no table: rows stay empty.
/// Errors: input (a damaged file, one of another run).
Result<report::Table> measurement_table(const std::filesystem::path& out, const Session& session);

}  // namespace orbitfuse::stages
