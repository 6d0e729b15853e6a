// SPDX-License-Identifier: BSD-3-Clause
#include "core/session/manifest_terms.hpp"

#include <gtest/gtest.h>

#include <regex>
#include <set>
#include <string>

#include "core/system/file_io.hpp"

namespace orbitfuse {
namespace {

using Words = std::set<std::string>;

/// The words in backquotes of docs/formats.md between two texts.
Words listed(const std::string& from, const std::string& to) {
  const std::string page = *read_file(std::string(ORBITFUSE_SOURCE_DIR) + "/docs/formats.md");
  const std::size_t begin = page.find(from);
  const std::size_t end = page.find(to, begin);
  EXPECT_NE(begin, std::string::npos) << from;
  EXPECT_NE(end, std::string::npos) << to;
  const std::string part = page.substr(begin, end - begin);
  const std::regex word("`([a-z-]+)`");
  Words words;
  for (std::sregex_iterator it(part.begin(), part.end(), word), over; it != over; ++it)
    words.insert((*it)[1]);
  return words;
}

template <class Table>
Words named(const Table& table) {
  Words words;
  for (std::size_t i = 0; i < table.size(); ++i) {
    EXPECT_EQ(static_cast<std::size_t>(table[i].term), i);
    EXPECT_TRUE(words.insert(std::string(table[i].name)).second) << table[i].name;
  }
  return words;
}

TEST(ManifestTerms, EventKindsAreThoseOfTheDocumentation) {
  EXPECT_EQ(named(event_kinds), listed("\nKinds of events:", "Readers take kinds"));
}

TEST(ManifestTerms, FrameFlagsAreThoseOfTheDocumentation) {
  EXPECT_EQ(named(frame_flags), listed("\nFlags of frames:", "Readers take flags"));
}

}  // namespace
}  // namespace orbitfuse
