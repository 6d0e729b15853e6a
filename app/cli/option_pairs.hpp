// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <initializer_list>
#include <string>

#include "core/result.hpp"

namespace orbitfuse::cli {

/// An option, and another that it depends on or has no meaning beside.
struct OptionPair {
  const char* option;
  bool given;
  const char* other;
  bool other_given;
};

/// Usage error for the first option that is given without its other one: it would be passed over in
/// silence.
inline Status check_needs(std::initializer_list<OptionPair> pairs) {
  for (const auto& [option, given, other, other_given] : pairs) {
    if (given && !other_given)
      return fail(ErrorKind::usage, option, std::string("given without ") + other,
                  std::string("give ") + other + " too, or leave it out");
  }
  return {};
}

/// Usage error for the first option that is given beside one that leaves it no meaning.
inline Status check_apart(std::initializer_list<OptionPair> pairs) {
  for (const auto& [option, given, other, other_given] : pairs) {
    if (given && other_given)
      return fail(ErrorKind::usage, option, std::string("given with ") + other,
                  "leave one of them out");
  }
  return {};
}

/// The same for options of `app` that all mean nothing beside `other`.
inline Status check_unused(const CLI::App& app, std::initializer_list<const char*> options,
                           const char* other) {
  for (const char* option : options)
    ORBITFUSE_TRY(check_apart({{option, app.count(option) > 0, other, true}}));
  return {};
}

}  // namespace orbitfuse::cli
