// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/inspection/details.hpp"
#include "recon/measurement/answer.hpp"
#include "recon/measurement/measurement_file.hpp"

namespace orbitfuse::inspection {

/// A difference between like components, and how urgent it is.
struct Comparison {
  std::string with;          ///< name of the reference; empty: of a difference's own two
  double difference_k = 0;   ///< NaN: no frame sees one of them, or reference_gone
  double uncertainty_k = 0;  ///< covers the error in 90 of 100 cases
  std::optional<PriorityClass> priority;  ///< none: below all classes, or not known
  /// What it may be as well within the uncertainty, in words; empty: the class is sure.
  std::string or_else;
  /// That the two stand for different object parameters, in words; none: they don't.
  std::optional<std::string> caution = {};
  bool reference_gone = false;  ///< it is no longer saved
  bool known() const;
};

/// One saved measurement with all that is said of it.
struct InspectionFinding {
  int number = 0;  ///< in the report, from 1
  std::string measurement, title, component, remark, recommendation;
  std::string created;  ///< when it was measured, ISO 8601 UTC
  measurement::Request request;
  measurement::Answer answer;
  std::optional<Comparison> comparison;
  std::vector<std::string> reference_of;  ///< measurements that are compared with this one

  /// Where it is: the place, the hottest of several, the first of a difference.
  std::optional<Eigen::Vector3d> position() const;
  /// What stands for it in a comparison.
  const measurement::TemperatureReading& reading() const;
};

/// Every saved measurement: those that `details` names first, in its order, then as they were
/// saved. Errors: usage (a finding or reference that names no saved measurement, itself or one
/// without a temperature; each with the nearest name), input (an answer that can't be read).
Result<std::vector<InspectionFinding>> findings_of(const measurement::Measurements& saved,
                                                   const InspectionDetails& details);

}  // namespace orbitfuse::inspection
