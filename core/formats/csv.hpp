// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <string>

namespace orbitfuse {

/// Text as a field of a CSV file (RFC 4180): in quotes where it needs them. Breaks become blanks,
/// since they tear rows for readers line by line, and what a spreadsheet would run as a formula is
/// kept from it by an apostrophe.
inline std::string csv_text(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  std::replace(text.begin(), text.end(), '\r', ' ');
  if (!text.empty() && std::string("=+-@\t").find(text.front()) != std::string::npos)
    text.insert(0, "'");
  if (text.find_first_of(",\"") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

}  // namespace orbitfuse
