// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace orbitfuse {

/// What an import tells, in the order in which it came up. A folder of 300 files of one program has
/// the same to be said of each: of more than three it becomes one sentence with the number and the
/// first names.
class Remarks {
 public:
  /// Of the whole.
  void add(std::string sentence);
  /// "`of``file`: `words`", where `of` is nothing or ends in a blank ("left out: "). Of one kind
  /// are those with the same `of` and `kind`; without a kind, with the same words but for numbers.
  void add_of_file(const std::string& of, const std::string& file, const std::string& words,
                   std::string kind = {});
  void left_out(const Error& error);
  void left_out(const std::string& file, const std::string& words, std::string kind = {});

  std::vector<std::string> sentences() const;

 private:
  struct Kind {
    std::string of, words;           ///< of the first
    bool alike = true;               ///< all words are
    std::vector<std::string> files;  ///< the first ones
    std::vector<std::string> words_of_files;
    std::size_t count = 0;
  };
  std::vector<Kind> kinds_;
  std::map<std::string, std::size_t> by_name_;
};

}  // namespace orbitfuse
