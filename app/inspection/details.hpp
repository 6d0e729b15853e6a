// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

// What a person adds to a run for its inspection report (assets/template.toml lists all keys).
namespace orbitfuse::inspection {

/// How urgent a difference between like components is.
struct PriorityClass {
  double from_k = 0;  ///< of the difference's size
  bool above = true;  ///< more than from_k; else from_k itself is in the class
  std::string name, action;
};

/// What is said of one saved measurement; where it is in measurements.json too, this holds.
struct FindingDetails {
  std::string measurement;  ///< its name
  std::string title, component, reference, remark, recommendation;
  std::string where;  ///< file:line, for errors
};

struct InspectionDetails {
  /// "inspection.object" and so on; absent or empty: not recorded.
  std::map<std::string, std::string> texts;
  std::optional<double> emissivity, reflected_c, distance_m, humidity_percent;
  std::vector<PriorityClass> classes;  ///< most urgent first; never empty
  std::vector<FindingDetails> findings;

  const std::string& text(const std::string& key) const;
};

/// Input and usage errors that name file and line: no such file, not TOML, an unknown key with the
/// nearest known one, a value of another type or out of range, two classes from one difference, a
/// finding without a measurement or named twice.
Result<InspectionDetails> read_details(const std::filesystem::path& file);
/// The same of a text; `name` stands for the file in errors.
Result<InspectionDetails> parse_details(std::string_view toml, const std::string& name);

/// A file to fill in, with every key and what it is for.
std::string_view details_template();

}  // namespace orbitfuse::inspection
