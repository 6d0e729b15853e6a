// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "recon/measurement/measurement_file.hpp"
#include "recon/measurement/thermal_scene.hpp"

namespace orbitfuse::cli {

/// `orbitfuse measure` as it was typed.
struct MeasureWords {
  std::string pixel, point, box, polygon, request, name;
  std::vector<std::string> line, distance, difference;  ///< two words each
  std::optional<int> hottest, coldest;
  std::optional<double> apart;
  std::optional<int> profile;
  std::optional<double> emissivity, reflected_c, distance_m, air_c, humidity_percent;
  std::optional<double> recorded_emissivity, recorded_reflected_c;
  std::string remark, component, reference;
  bool save = false, csv = false;
};

/// Whether a word that reads as a number is the name of a new view: they are called 000, 001 ...
bool names_new_view(const std::string& word);

void add_measure_options(CLI::App& app, MeasureWords& words);

/// Usage error for options that mean nothing beside the others, or without another one.
Status check_pairs(const MeasureWords& words);

/// The one request among the options; none where none asks for a measurement. Usage error where two
/// do, or for words that are no place. Names of saved measurements stand for what was asked then.
Result<std::optional<measurement::Request>> request_of(const MeasureWords& words,
                                                       const measurement::ThermalScene& scene,
                                                       const measurement::Measurements& saved);

}  // namespace orbitfuse::cli
