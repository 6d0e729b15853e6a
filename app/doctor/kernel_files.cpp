// SPDX-License-Identifier: BSD-3-Clause
#include "app/doctor/kernel_files.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <fstream>

namespace orbitfuse::doctor {

std::optional<std::string> line_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  if (!std::getline(in, line)) return std::nullopt;
  return line;
}

std::optional<long long> number_of(const std::filesystem::path& file) {
  const std::optional<std::string> line = line_of(file);
  if (!line) return std::nullopt;
  char* end = nullptr;
  errno = 0;
  const long long value = std::strtoll(line->c_str(), &end, 0);
  if (end == line->c_str() || errno != 0) return std::nullopt;
  return value;
}

std::vector<std::string> names_in(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    names.push_back(entry->path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace orbitfuse::doctor
