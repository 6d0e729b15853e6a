// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <utility>

namespace orbitfuse::testing {

using MetricsByName = std::map<std::string, double>;

/// reference/metrics.csv of the shared fusion data: by pair and method.
inline std::map<std::pair<std::string, std::string>, MetricsByName> fusion_reference(
    const std::filesystem::path& file) {
  std::map<std::pair<std::string, std::string>, MetricsByName> values;
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::istringstream cells(line);
    std::string pair, method, metric, value;
    std::getline(cells, pair, ',');
    std::getline(cells, method, ',');
    std::getline(cells, metric, ',');
    std::getline(cells, value, ',');
    values[{pair, method}][metric] = std::stod(value);
  }
  return values;
}

}  // namespace orbitfuse::testing
