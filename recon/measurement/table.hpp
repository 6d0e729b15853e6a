// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "recon/measurement/answer.hpp"

namespace orbitfuse::measurement {

/// Column names of csv_rows(), with their units, as one line of CSV.
std::string csv_header();

/// An answer as lines of CSV (RFC 4180), temperatures in Celsius: one line a measurement, spot of
/// several or point of a profile; a difference gives its parts too. What is unknown is an empty
/// field.
std::vector<std::string> csv_rows(const std::string& name, const Answer& answer);

/// What is to be known beside a figure: of place `spot` of several, and of the whole answer.
std::string notes_of(const Answer& answer, std::size_t spot);
/// The same of an answer of one place.
std::string notes_of(const Answer& answer);

/// For people, e.g. "36.12 C +- 0.31 (14 frames 35.90 to 36.41; field 36.05; 31 deg)".
std::string described(const TemperatureReading& reading);
/// What "+-" stands for in these, as a sentence's end.
inline constexpr const char* uncertainty_words =
    "covers the error in 90 of 100 cases, apart from the camera's calibration and the object "
    "parameters";
/// The whole answer, a line each.
std::vector<std::string> described(const Answer& answer);

}  // namespace orbitfuse::measurement
