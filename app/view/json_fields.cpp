// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/json_fields.hpp"

#include <fmt/format.h>

#include <cmath>

#include "core/nested_text.hpp"

namespace orbitfuse::view {
using nlohmann::json;

namespace {

tl::unexpected<Error> wrong(const json& j, const char* field, const std::string& wanted) {
  const auto found = j.find(field);
  return fail(ErrorKind::usage, field, found == j.end() ? "not given" : shown(*found), wanted);
}

}  // namespace

std::string shown(const json& j) {
  std::string text = j.dump(-1, ' ', true, json::error_handler_t::replace);
  if (text.size() > 60) text = text.substr(0, 57) + "...";
  return text;
}

Result<json> json_body(const std::string& body) {
  json j = parse_json(body);
  if (!j.is_object()) return fail(ErrorKind::usage, "the request", "no JSON object", "send one");
  return j;
}

Result<double> number_field(const json& j, const char* field, double low, double high) {
  const auto found = j.find(field);
  if (found == j.end() || !found->is_number()) return wrong(j, field, "must be a number");
  const double value = found->get<double>();
  if (!(value >= low && value <= high))
    return wrong(j, field, fmt::format("must be {:g} to {:g}", low, high));
  return value;
}

Result<std::string> text_field(const json& j, const char* field, std::size_t longest) {
  const auto found = j.find(field);
  if (found == j.end() || !found->is_string() || found->get<std::string>().empty() ||
      found->get<std::string>().size() > longest)
    return wrong(j, field, fmt::format("must be 1 to {} characters", longest));
  return found->get<std::string>();
}

Result<std::vector<double>> numbers_field(const json& j, const char* field, std::size_t count) {
  constexpr double farthest = 1e6;
  const std::string wanted = fmt::format("must be {} numbers below {:g}", count, farthest);
  const auto found = j.find(field);
  if (found == j.end() || !found->is_array() || found->size() != count)
    return wrong(j, field, wanted);
  std::vector<double> values;
  for (const json& entry : *found) {
    if (!entry.is_number() || !(std::abs(entry.get<double>()) <= farthest))
      return wrong(j, field, wanted);
    values.push_back(entry.get<double>());
  }
  return values;
}

}  // namespace orbitfuse::view
