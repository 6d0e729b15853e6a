// SPDX-License-Identifier: BSD-3-Clause
#include "tests/structure/function_lengths.hpp"

#include <algorithm>
#include <cctype>
#include <cstring>
#include <regex>
#include <sstream>

namespace orbitfuse::structure {
namespace {

/// The source with the same lines, without comments, preprocessor lines and what quotes hold.
class CodeOnly {
 public:
  explicit CodeOnly(const std::string& source) : source_(source) {}

  std::string text() {
    while (at_ < source_.size()) {
      if (starts("//") || at_line_start_hash()) {
        skip_line();
      } else if (starts("/*")) {
        skip_past("*/");
      } else if (starts("R\"")) {
        const std::size_t open = source_.find('(', at_);
        skip_past(")" + source_.substr(at_ + 2, open - at_ - 2) + "\"");
      } else if (source_[at_] == '"' || (source_[at_] == '\'' && !between_digits())) {
        skip_quoted(source_[at_]);
      } else {
        code_ += source_[at_++];
      }
    }
    return code_;
  }

 private:
  bool starts(const char* with) const { return source_.compare(at_, std::strlen(with), with) == 0; }
  bool at_line_start_hash() const {
    if (source_[at_] != '#') return false;
    const std::size_t before = source_.find_last_not_of(' ', at_ == 0 ? 0 : at_ - 1);
    return at_ == 0 || before == std::string::npos || source_[before] == '\n';
  }
  bool between_digits() const {  // 100'000
    return at_ > 0 && at_ + 1 < source_.size() &&
           std::isxdigit(static_cast<unsigned char>(source_[at_ - 1])) &&
           std::isxdigit(static_cast<unsigned char>(source_[at_ + 1])) &&
           (at_ + 2 >= source_.size() || source_[at_ + 2] != '\'');
  }
  void skip_to(std::size_t end) {
    end = std::min(end, source_.size());
    code_.append(static_cast<std::size_t>(
                     std::count(source_.begin() + static_cast<std::ptrdiff_t>(at_),
                                source_.begin() + static_cast<std::ptrdiff_t>(end), '\n')),
                 '\n');
    at_ = end;
  }
  void skip_line() {
    std::size_t end = source_.find('\n', at_);
    while (end != std::string::npos && source_[end - 1] == '\\') end = source_.find('\n', end + 1);
    skip_to(end);
  }
  void skip_past(const std::string& mark) {
    const std::size_t end = source_.find(mark, at_ + 2);
    skip_to(end == std::string::npos ? end : end + mark.size());
  }
  void skip_quoted(char quote) {
    std::size_t end = at_ + 1;
    while (end < source_.size() && source_[end] != quote) end += source_[end] == '\\' ? 2 : 1;
    skip_to(end + 1);
  }

  const std::string& source_;
  std::string code_;
  std::size_t at_ = 0;
};

enum class Opens {
  function,
  room,
  value
};  // a room: namespace or type, where functions may follow

/// What a brace opens, by the words before it back to the last ; { or }.
Opens opened_by(const std::string& head) {
  static const std::regex room(
      R"(\b(?:namespace|extern)\b|\b(?:struct|class|enum|union)\b[^()]*$)"),
      function(R"(\)\s*(?:(?:const|noexcept|override|final|try)\s*|->[^()]*|:[^:][^]*\)\s*)*$)");
  if (std::regex_search(head, room)) return Opens::room;
  return std::regex_search(head, function) ? Opens::function : Opens::value;
}

std::string on_one_line(const std::string& head) {
  std::istringstream words(head);
  std::string line;
  for (std::string word; words >> word;) line += (line.empty() ? "" : " ") + word;
  return line;
}

}  // namespace

std::vector<Function> functions_of(const std::string& source) {
  std::vector<Function> functions;
  std::string head;
  int line = 1, parentheses = 0;
  int skipped = 0;  // depth inside a function or a value's braces
  bool in_function = false;
  for (const char c : CodeOnly(source).text()) {
    if (c == '\n') ++line;
    if (skipped > 0) {
      skipped += c == '{' ? 1 : c == '}' ? -1 : 0;
      if (skipped == 0 && in_function) {
        functions.back().lines = line - functions.back().first_line + 1;
        in_function = false;
        head.clear();
      } else if (skipped == 0) {
        head += "()";  // the last member initialised so is followed by the constructor's body
      }
      continue;
    }
    parentheses += c == '(' ? 1 : c == ')' ? -1 : 0;
    const Opens opens =
        c == '{' ? (parentheses > 0 ? Opens::value : opened_by(head)) : Opens::value;
    if (c == '{' && opens != Opens::room) {
      skipped = 1;
      in_function = opens == Opens::function;
      if (in_function) functions.push_back({on_one_line(head), line, 0});
    } else if (c == '{' || c == '}' || (c == ';' && parentheses == 0)) {
      head.clear();
    } else {
      head += c;
    }
  }
  return functions;
}

}  // namespace orbitfuse::structure
