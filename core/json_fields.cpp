// SPDX-License-Identifier: BSD-3-Clause
#include "core/json_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace orbitfuse {
namespace {

using Json = nlohmann::json;

// Times of bigger size would overflow where they are subtracted.
constexpr std::int64_t largest = std::int64_t{1} << 62;
// Ids near 2^64 would wrap where they are counted on; JSON's readers keep integers to 2^53. No
// camera comes there: it would take 285,000 years at 1,000 frames a second.
constexpr std::uint64_t largest_count = std::uint64_t{1} << 53;

std::optional<std::int64_t> whole(const Json* value, std::int64_t low, std::int64_t high) {
  if (value == nullptr || !value->is_number_integer()) return std::nullopt;
  const auto number = value->get<std::int64_t>();
  const bool wrapped = value->is_number_unsigned() && number < 0;
  if (wrapped || number < low || number > high) return std::nullopt;
  return number;
}

/// False, and nothing read, unless they are so many finite numbers in that range.
bool read_numbers(const Json* list, double* values, std::size_t count,
                  const OptionRange& range = {}) {
  if (list == nullptr || !list->is_array() || list->size() != count) return false;
  for (const Json& entry : *list)
    if (!entry.is_number() || !std::isfinite(entry.get<double>()) ||
        !range.contains(entry.get<double>()))
      return false;
  for (std::size_t i = 0; i < count; ++i) values[i] = (*list)[i].get<double>();
  return true;
}

bool read_texts(const Json& list, std::vector<std::string>& texts) {
  if (!list.is_array()) return false;
  for (const Json& entry : list) {
    if (!entry.is_string()) return false;
    texts.push_back(entry.get<std::string>());
  }
  return true;
}

}  // namespace

Status JsonFields::check_object() const {
  if (object_.is_object()) return {};
  return fail(source_.kind, place(), shown(object_),
              "must be an object" + (source_.remedy.empty() ? "" : ": " + source_.remedy));
}

Status JsonFields::check_keys(std::initializer_list<std::string_view> known) const {
  ORBITFUSE_TRY(check_object());
  for (const auto& [key, value] : object_.items())
    if (std::find(known.begin(), known.end(), key) == known.end())
      return fail(source_.kind, at(key.c_str()), "unknown", "leave it out");
  return {};
}

std::vector<std::string> JsonFields::keys() const {
  std::vector<std::string> names;
  if (object_.is_object())
    for (const auto& [key, value] : object_.items()) names.push_back(key);
  return names;
}

const Json* JsonFields::find(const char* key) const {
  if (!object_.is_object()) return nullptr;
  const auto found = object_.find(key);
  return found == object_.end() || found->is_null() ? nullptr : &*found;
}

tl::unexpected<Error> JsonFields::wrong(const char* key, const std::string& expected) const {
  const Json* found = find(key);
  return fail(source_.kind, at(key), found == nullptr ? "missing" : shown(*found),
              "must be " + expected + (source_.remedy.empty() ? "" : ": " + source_.remedy));
}

Status JsonFields::get(const char* key, double& value) const {
  const Json* found = find(key);
  if (found == nullptr || !found->is_number()) return wrong(key, "a number");
  const double number = found->get<double>();
  if (!std::isfinite(number)) return wrong(key, "a finite number");
  value = number;
  return {};
}

Status JsonFields::get(const char* key, int& value) const {
  const auto number =
      whole(find(key), std::numeric_limits<int>::min(), std::numeric_limits<int>::max());
  if (!number) return wrong(key, "a whole number");
  value = static_cast<int>(*number);
  return {};
}

Status JsonFields::get(const char* key, std::int64_t& value) const {
  const auto number = whole(find(key), -largest, largest);
  if (!number) return wrong(key, "a whole number of at most 2^62 either way");
  value = *number;
  return {};
}

Status JsonFields::get(const char* key, std::uint64_t& value) const {
  const auto number = whole(find(key), 0, static_cast<std::int64_t>(largest_count));
  if (!number) return wrong(key, "a whole number from 0 to 2^53");
  value = static_cast<std::uint64_t>(*number);
  return {};
}

Status JsonFields::get(const char* key, bool& value) const {
  const Json* found = find(key);
  if (found == nullptr || !found->is_boolean()) return wrong(key, "true or false");
  value = found->get<bool>();
  return {};
}

Status JsonFields::get(const char* key, std::string& value) const {
  const Json* found = find(key);
  if (found == nullptr || !found->is_string()) return wrong(key, "a text");
  value = found->get<std::string>();
  return {};
}

Status JsonFields::get(const char* key, std::vector<std::string>& value) const {
  const Json* found = find(key);
  std::vector<std::string> texts;
  if (found == nullptr || !read_texts(*found, texts)) return wrong(key, "a list of texts");
  value = std::move(texts);
  return {};
}

Status JsonFields::get(const char* key, std::vector<std::vector<std::string>>& value) const {
  ORBITFUSE_ASSIGN(const Json* entries, list(key));
  std::vector<std::vector<std::string>> lists(entries->size());
  for (std::size_t i = 0; i < lists.size(); ++i)
    if (!read_texts((*entries)[i], lists[i])) return wrong(key, "a list of lists of texts");
  value = std::move(lists);
  return {};
}

Status JsonFields::get(const char* key, Eigen::Vector3d& value) const {
  return numbers(key, value.data(), 3, {});
}

Status JsonFields::get(const char* key, Eigen::Vector3d& value, const OptionRange& range) const {
  return numbers(key, value.data(), 3, range);
}

Status JsonFields::get_word(const char* key, std::string& value, std::size_t longest) const {
  std::string text;
  const Status read = get(key, text);
  if (!read || text.empty() || text.size() > longest)
    return wrong(key, fmt::format("a text of 1 to {} bytes", longest));
  value = std::move(text);
  return {};
}

Status JsonFields::get(const char* key, double& value, const OptionRange& range) const {
  return get_within(key, value, range, "a number, ");
}

Status JsonFields::get(const char* key, int& value, const OptionRange& range) const {
  return get_within(key, value, range, "a whole number, ");
}

template <class T>
Status JsonFields::get_within(const char* key, T& value, const OptionRange& range,
                              const char* kind) const {
  T number{};
  const Status read = get(key, number);
  if (!read || !range.contains(number)) return wrong(key, kind + range.words());
  value = number;
  return {};
}

Status JsonFields::numbers(const char* key, double* values, std::size_t count,
                           const OptionRange& range) const {
  if (read_numbers(find(key), values, count, range)) return {};
  return wrong(key, fmt::format("a list of {} numbers, each {}", count, range.words()));
}

Status JsonFields::get(const char* key, std::vector<Eigen::Vector3d>& value) const {
  ORBITFUSE_ASSIGN(const Json* entries, list(key));
  std::vector<Eigen::Vector3d> points(entries->size());
  for (std::size_t i = 0; i < points.size(); ++i)
    if (!read_numbers(&(*entries)[i], points[i].data(), 3)) return wrong(key, "a list of points");
  value = std::move(points);
  return {};
}

std::string JsonFields::remark(const char* key) const {
  const Json* found = find(key);
  return found != nullptr && found->is_string() ? found->get<std::string>() : std::string();
}

bool JsonFields::marked(const char* key) const {
  const Json* found = find(key);
  return found != nullptr && *found == true;
}

Result<JsonFields> JsonFields::child(const char* key) const {
  const Json* found = find(key);
  if (found == nullptr || !found->is_object()) return wrong(key, "an object");
  return JsonFields(*found, at(key) + ".", source_);
}

Result<const Json*> JsonFields::list(const char* key) const {
  const Json* found = find(key);
  if (found == nullptr || !found->is_array()) return wrong(key, "a list");
  return found;
}

Result<std::vector<JsonFields>> JsonFields::children(const char* key) const {
  ORBITFUSE_ASSIGN(const Json* entries, list(key));
  std::vector<JsonFields> result;
  for (std::size_t i = 0; i < entries->size(); ++i) {
    result.emplace_back((*entries)[i], fmt::format("{}[{}].", at(key), i), source_);
    ORBITFUSE_TRY(result.back().check_object());
  }
  return result;
}

std::string shown(const Json& value) {
  std::string text = value.dump(-1, ' ', true, Json::error_handler_t::replace);
  if (text.size() > 60) text = text.substr(0, 57) + "...";
  return text;
}

}  // namespace orbitfuse
