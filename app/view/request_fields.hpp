// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "core/json_fields.hpp"
#include "core/nested_text.hpp"

// What the viewer's page sends: JSON objects, whose errors name the field.
namespace orbitfuse::view {

/// Of each coordinate of a place: beyond it nothing is drawn or measured.
constexpr OptionRange reachable = from_to(-1e6, 1e6);

inline JsonFields request_fields(const nlohmann::json& body) {
  return {body, "", {.kind = ErrorKind::usage, .remedy = {}}};
}

inline Result<nlohmann::json> json_body(const std::string& body) {
  nlohmann::json j = parse_json(body);
  if (!j.is_object()) return fail(ErrorKind::usage, "the request", "no JSON object", "send one");
  return j;
}

}  // namespace orbitfuse::view
