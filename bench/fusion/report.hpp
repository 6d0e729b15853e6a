// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bench/fusion/pairs.hpp"
#include "core/result.hpp"

namespace orbitfuse::bench {

/// One line of the sweep: "METHOD" or "METHOD, KNOB VALUE".
struct Row {
  std::string what;
  Scores means;
  Times times;
  bool timed = false;
};

void print_header();
void print(const Row& row);
Status write_reports(const std::filesystem::path& folder, const std::vector<Row>& rows);

}  // namespace orbitfuse::bench
