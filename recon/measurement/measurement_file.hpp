// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "recon/measurement/request.hpp"

// measurements.json: what was measured in a run, to be shown, changed and measured again
// (docs/formats.md).
namespace orbitfuse::measurement {

inline constexpr int measurement_schema = 1;
inline constexpr const char* measurements_file = "measurements.json";
/// Of a name that is saved: reports and the viewer write it into tables and pictures. Longer ones
/// of earlier versions are read, and can be removed.
inline constexpr std::size_t longest_name_bytes = 200;

struct SavedMeasurement {
  std::string name;     ///< unique in the file, never empty
  std::string created;  ///< ISO 8601 UTC
  Request request;
  nlohmann::json answer;  ///< to_json(Answer) of that time
  /// For reports, each may be empty: what was noticed, what it is of, and the name of the
  /// measurement that it is compared with.
  std::string remark = {}, component = {}, reference = {};
};

/// What became of one that was added.
struct Kept {
  std::string name;
  bool replaced = false;  ///< one of that name was there before
  /// What happened to that one's words, for the user: "remark 'loose' stays". Empty: it had none.
  std::string words = {};
};

/// Usage error: longer than longest_name_bytes.
Status check_name(const std::string& name);

/// {"name", "created", "request", "answer"}, and "remark", "component", "reference" where they were
/// given.
nlohmann::json to_json(const SavedMeasurement& saved);

struct Measurements {
  std::string identity;  ///< ThermalScene::identity of the run that they belong to
  std::vector<SavedMeasurement> list;
  std::vector<std::string> notes;  ///< what was read otherwise than it stands in the file

  const SavedMeasurement* find(const std::string& name) const;
  /// Adds it, or takes the place of the one of that name. That one's remark, component and
  /// reference stay where the new one has none and measures the same place, whatever the object
  /// parameters; of another place they would be wrong. Without a name it gets the first free of
  /// "spot 1", "spot 2" ...
  Kept put(SavedMeasurement measurement);
};

/// An absent file is an empty list. Input errors, each naming the file and what to do: cut or
/// damaged JSON, another schema, a measurement that isn't one, two of one name, and measurements of
/// another run (`identity` differs): the file is left as it is.
Result<Measurements> load_measurements(const std::filesystem::path& file,
                                       const std::string& identity);
/// Saved distances in the metres that a unit of the run is now: its scale may have been told anew
/// since. None: without metres.
void bring_to_scale(Measurements& saved, std::optional<double> metres_per_unit,
                    double relative_sigma);
/// Loads, puts (Measurements::put) and saves, as one step: programs that do so at once wait for
/// each other. `created` is set to now where it is empty. Errors: both's, and check_name's.
Result<Kept> add_measurement(const std::filesystem::path& file, const std::string& identity,
                             SavedMeasurement measurement);
/// Loads, takes the measurement of that name out and saves, as one step. Errors: both's; input:
/// there is none.
Status remove_measurement(const std::filesystem::path& file, const std::string& identity,
                          const std::string& name);
/// Atomic: readers see the old list or the new one. Errors: input (larger than what is read again),
/// device (it can't be written); the file is left as it is then.
Status save_measurements(const std::filesystem::path& file, const Measurements& measurements);

}  // namespace orbitfuse::measurement
