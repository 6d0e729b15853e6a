// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/option_range.hpp"
#include "core/result.hpp"

namespace orbitfuse {

/// What the errors of all fields of one source say: a file that others made, a request.
struct FieldSource {
  ErrorKind kind = ErrorKind::input;
  std::string remedy;  ///< beside what the field must be; may be empty
};

/// Typed access to the fields of one JSON object from outside. A field that is null counts as not
/// there. Errors name the field, what was found there and what it must be.
class JsonFields {
 public:
  using Json = nlohmann::json;

  /// `object` has to outlive it; what is no object has no fields. `prefix` stands before a field's
  /// name as it is: "manifest.jsonl:7: ", "answer.".
  JsonFields(const Json& object, std::string prefix, FieldSource source)
      : object_(object), prefix_(std::move(prefix)), source_(std::move(source)) {}

  /// Error unless it is an object; of these fields only.
  Status check_object() const;
  Status check_keys(std::initializer_list<std::string_view> known) const;

  bool has(const char* key) const { return find(key) != nullptr; }
  /// Of an object whose fields are names.
  std::vector<std::string> keys() const;
  /// Null where it isn't there.
  const Json* find(const char* key) const;
  std::string at(const char* key) const { return prefix_ + key; }
  /// Of the object itself.
  std::string place() const { return prefix_.substr(0, prefix_.find_last_not_of(".: ") + 1); }

  /// Error unless the field is there and is: a finite number; a whole number that fits the type
  /// (counts to 2^53, so that they can be counted on; times to 2^62, so that they can be
  /// subtracted); true or false; a text; a list of texts, or of such lists; so many
  /// numbers; a list of points.
  Status get(const char* key, double& value) const;
  Status get(const char* key, int& value) const;
  Status get(const char* key, std::int64_t& value) const;
  Status get(const char* key, std::uint64_t& value) const;
  Status get(const char* key, bool& value) const;
  Status get(const char* key, std::string& value) const;
  Status get(const char* key, std::vector<std::string>& value) const;
  Status get(const char* key, std::vector<std::vector<std::string>>& value) const;
  Status get(const char* key, Eigen::Vector3d& value) const;
  Status get(const char* key, std::vector<Eigen::Vector3d>& value) const;
  template <std::size_t N>
  Status get(const char* key, std::array<double, N>& value) const {
    return numbers(key, value.data(), N, {});
  }
  template <class T>
  Status get(const char* key, std::optional<T>& value) const {
    T found{};
    ORBITFUSE_TRY(get(key, found));
    value = std::move(found);
    return {};
  }
  /// A text of one byte or more, up to so many.
  Status get_word(const char* key, std::string& value, std::size_t longest) const;
  /// In that range; of several numbers each.
  Status get(const char* key, double& value, const OptionRange& range) const;
  Status get(const char* key, int& value, const OptionRange& range) const;
  Status get(const char* key, Eigen::Vector3d& value, const OptionRange& range) const;
  template <std::size_t N>
  Status get(const char* key, std::array<double, N>& value, const OptionRange& range) const {
    return numbers(key, value.data(), N, range);
  }

  /// Several, each key before what it is read into.
  template <class T, class... More>
  Status get_all(const char* key, T& value, More&&... more) const {
    ORBITFUSE_TRY(get(key, value));
    if constexpr (sizeof...(more) > 0) return get_all(std::forward<More>(more)...);
    return {};
  }
  /// The same of those that are there; the others stay as they are.
  template <class T, class... More>
  Status get_present(const char* key, T& value, More&&... more) const {
    if (has(key)) ORBITFUSE_TRY(get(key, value));
    if constexpr (sizeof...(more) > 0) return get_present(std::forward<More>(more)...);
    return {};
  }

  /// Words beside the data, which nothing rests on: empty unless there is a text.
  std::string remark(const char* key) const;
  /// A mark that stands only where it holds: false unless it is there and true.
  bool marked(const char* key) const;

  /// The object below a key, its fields named "key.field".
  Result<JsonFields> child(const char* key) const;
  /// The entries of a list of objects, named "key[0].field".
  Result<std::vector<JsonFields>> children(const char* key) const;
  /// The whole list; its entries are the caller's to check.
  Result<const Json*> list(const char* key) const;

  /// What was found there, and what it must be ("a number").
  tl::unexpected<Error> wrong(const char* key, const std::string& expected) const;

 private:
  template <class T>
  Status get_within(const char* key, T& value, const OptionRange& range, const char* kind) const;
  Status numbers(const char* key, double* values, std::size_t count,
                 const OptionRange& range) const;

  const Json& object_;
  std::string prefix_;
  FieldSource source_;
};

/// Of a value in an error: short, and only ASCII.
std::string shown(const nlohmann::json& value);

}  // namespace orbitfuse
