// SPDX-License-Identifier: BSD-3-Clause
#include "app/inspection/findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "app/config/settings.hpp"

namespace orbitfuse::inspection {
namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
using measurement::Answer;
using measurement::Kind;
using measurement::Measurements;
using measurement::SavedMeasurement;

std::vector<std::string> names_of(const Measurements& saved) {
  std::vector<std::string> names;
  for (const SavedMeasurement& m : saved.list) names.push_back(m.name);
  return names;
}

tl::unexpected<Error> not_saved(const std::string& where, const std::string& name,
                                const Measurements& saved) {
  const std::string guess = config::nearest(name, names_of(saved));
  return fail(ErrorKind::usage, where, "no saved measurement is named '" + name + "'",
              guess.empty() ? "orbitfuse measure OUT lists them, --save --name adds one"
                            : "did you mean '" + guess + "'?");
}

/// The class of a difference's size; nullptr below all.
const PriorityClass* class_of(double size_k, const std::vector<PriorityClass>& classes) {
  for (const PriorityClass& c : classes)
    if (c.above ? size_k > c.from_k : size_k >= c.from_k) return &c;
  return nullptr;
}

void classify(Comparison& comparison, const std::vector<PriorityClass>& classes) {
  if (!comparison.known()) return;
  const double size = std::abs(comparison.difference_k);
  const PriorityClass* is = class_of(size, classes);
  if (is != nullptr) comparison.priority = *is;
  if (!std::isfinite(comparison.uncertainty_k)) return;
  const auto words = [](const PriorityClass* c) {
    return c == nullptr ? std::string("below the classes") : "class " + c->name;
  };
  for (const double other : {size + comparison.uncertainty_k, size - comparison.uncertainty_k}) {
    const PriorityClass* could_be = class_of(std::max(0.0, other), classes);
    if (could_be == is) continue;
    if (!comparison.or_else.empty()) comparison.or_else += " or ";
    comparison.or_else += words(could_be);
  }
}

Result<InspectionFinding> finding_of(const SavedMeasurement& saved, const FindingDetails* said) {
  InspectionFinding finding;
  finding.measurement = saved.name;
  finding.created = saved.created;
  finding.request = saved.request;
  const auto answer = measurement::answer_of_json(saved.answer);
  if (!answer)
    return fail(ErrorKind::input,
                fmt::format("{}: '{}': {}", measurement::measurements_file, saved.name,
                            answer.error().where),
                answer.error().found, answer.error().remedy);
  finding.answer = *answer;
  const auto either = [](const std::string& here, const std::string& there) {
    return here.empty() ? there : here;
  };
  static const FindingDetails nothing;
  const FindingDetails& details = said != nullptr ? *said : nothing;
  finding.title = either(details.title, saved.name);
  finding.component = either(details.component, saved.component);
  finding.remark = either(details.remark, saved.remark);
  finding.recommendation = details.recommendation;
  return finding;
}

/// Where its reference is named, for errors.
std::string where_of(const FindingDetails* said, const std::string& measurement) {
  if (said != nullptr && !said->reference.empty()) return said->where;
  return fmt::format("{}: reference of '{}'", measurement::measurements_file, measurement);
}

Result<Comparison> comparison_of(const InspectionFinding& finding, const std::string& reference,
                                 const std::string& where,
                                 const std::vector<InspectionFinding>& all,
                                 const Measurements& saved) {
  if (saved.find(reference) == nullptr) return not_saved(where, reference, saved);
  if (reference == finding.measurement)
    return fail(ErrorKind::usage, where, "'" + reference + "' is its own reference",
                "name the measurement of a like component");
  const auto other = std::find_if(all.begin(), all.end(), [&](const InspectionFinding& f) {
    return f.measurement == reference;
  });
  for (const InspectionFinding* part : {&finding, &*other})
    if (part->answer.kind == Kind::difference || part->answer.kind == Kind::distance)
      return fail(ErrorKind::usage, where,
                  fmt::format("'{}' is a {}, with no temperature of its own", part->measurement,
                              measurement::name(part->answer.kind)),
                  "compare spots, boxes, lines, polygons or hottest places");
  const auto &a = finding.reading(), &b = other->reading();
  Comparison comparison{reference,
                        a.temperature_k - b.temperature_k,
                        std::hypot(a.uncertainty_k, b.uncertainty_k),
                        {},
                        {}};
  comparison.caution =
      measurement::parameters_differ(finding.answer.radiometry, other->answer.radiometry);
  return comparison;
}

}  // namespace

bool Comparison::known() const { return std::isfinite(difference_k); }

const measurement::TemperatureReading& InspectionFinding::reading() const {
  const Answer& a = answer.of.empty() ? answer : answer.of.front();
  return a.spots.empty() ? a.reading : a.spots.front().reading;
}

std::optional<Eigen::Vector3d> InspectionFinding::position() const {
  const Answer& a = answer.of.empty() ? answer : answer.of.front();
  const std::optional<Eigen::Vector3d> found =
      !a.spots.empty()     ? a.spots.front().position
      : a.position         ? a.position
      : a.ends.size() == 2 ? std::optional<Eigen::Vector3d>(0.5 * (a.ends[0] + a.ends[1]))
                           : std::nullopt;
  return found && found->allFinite() ? found : std::nullopt;
}

Result<std::vector<InspectionFinding>> findings_of(const Measurements& saved,
                                                   const InspectionDetails& details) {
  std::vector<std::pair<const SavedMeasurement*, const FindingDetails*>> order;
  for (const FindingDetails& said : details.findings) {
    const SavedMeasurement* of = saved.find(said.measurement);
    if (of == nullptr) return not_saved(said.where, said.measurement, saved);
    order.emplace_back(of, &said);
  }
  for (const SavedMeasurement& m : saved.list)
    if (std::none_of(order.begin(), order.end(), [&](const auto& o) { return o.first == &m; }))
      order.emplace_back(&m, nullptr);
  std::vector<InspectionFinding> findings;
  for (const auto& [of, said] : order) {
    ORBITFUSE_ASSIGN(InspectionFinding finding, finding_of(*of, said));
    finding.number = static_cast<int>(findings.size()) + 1;
    findings.push_back(std::move(finding));
  }
  for (std::size_t i = 0; i < findings.size(); ++i) {
    InspectionFinding& finding = findings[i];
    const auto& [of, said] = order[i];
    const std::string& reference =
        said != nullptr && !said->reference.empty() ? said->reference : of->reference;
    const bool said_here = said != nullptr && !said->reference.empty();
    if (!reference.empty() && !said_here && saved.find(reference) == nullptr) {
      // Removed since: the user who saved it can't mend that here, and the rest is right.
      finding.comparison = Comparison{reference + " (no longer saved)", unknown, unknown, {}, {}};
      finding.comparison->reference_gone = true;
    } else if (!reference.empty()) {
      ORBITFUSE_ASSIGN(
          finding.comparison,
          comparison_of(finding, reference, where_of(said, finding.measurement), findings, saved));
      for (InspectionFinding& other : findings)
        if (other.measurement == reference) other.reference_of.push_back(finding.title);
    } else if (finding.answer.kind == Kind::difference) {
      finding.comparison = Comparison{
          "", finding.answer.difference_k, finding.answer.difference_uncertainty_k, {}, {}};
      if (finding.answer.of.size() == 2)
        finding.comparison->caution = measurement::parameters_differ(
            finding.answer.of[0].radiometry, finding.answer.of[1].radiometry);
    }
    if (finding.comparison) classify(*finding.comparison, details.classes);
  }
  return findings;
}

}  // namespace orbitfuse::inspection
