// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/remarks.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cctype>
#include <utility>

namespace orbitfuse {
namespace {

constexpr std::size_t most_named = 3;

/// The words with each number as one sign: of 300 files each may have another.
std::string without_numbers(std::string_view words) {
  std::string kind;
  for (const char c : words) {
    if (std::isdigit(static_cast<unsigned char>(c)) == 0)
      kind += c;
    else if (kind.empty() || kind.back() != '#')
      kind += '#';
  }
  return kind;
}

}  // namespace

void Remarks::add(std::string sentence) {
  Kind kind;
  kind.words = std::move(sentence);
  kinds_.push_back(std::move(kind));
}

void Remarks::add_of_file(const std::string& of, const std::string& file, const std::string& words,
                          std::string kind) {
  if (kind.empty()) kind = without_numbers(words);
  const auto [at, is_new] = by_name_.emplace(of + '\n' + kind, kinds_.size());
  if (is_new) {
    kinds_.emplace_back();
    kinds_.back().of = of;
    kinds_.back().words = words;
  }
  Kind& same = kinds_[at->second];
  ++same.count;
  same.alike = same.alike && words == same.words;
  if (same.files.size() == most_named) return;
  same.files.push_back(file);
  same.words_of_files.push_back(words);
}

void Remarks::left_out(const Error& error) {
  left_out(error.where, error.remedy.empty() ? error.found : error.found + "; " + error.remedy);
}

void Remarks::left_out(const std::string& file, const std::string& words, std::string kind) {
  add_of_file("left out: ", file, words, std::move(kind));
}

std::vector<std::string> Remarks::sentences() const {
  std::vector<std::string> list;
  for (const Kind& kind : kinds_) {
    if (kind.count == 0) {
      list.push_back(kind.words);
      continue;
    }
    if (kind.count <= most_named) {
      for (std::size_t i = 0; i < kind.files.size(); ++i)
        list.push_back(fmt::format("{}{}: {}", kind.of, kind.files[i], kind.words_of_files[i]));
      continue;
    }
    list.push_back(fmt::format("{}{} files ({} and {} more): {}{}", kind.of, kind.count,
                               fmt::join(kind.files, ", "), kind.count - most_named, kind.words,
                               kind.alike ? "" : " (of the first; of the others likewise)"));
  }
  return list;
}

}  // namespace orbitfuse
