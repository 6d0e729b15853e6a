// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace orbitfuse::structure {

struct Function {
  std::string head;  ///< what stands before its brace, on one line
  int first_line = 0;
  int lines = 0;  ///< from the line of the head's end to that of the closing brace
};

/// Functions of a source, those inside another (lambdas, local classes) counted with it.
std::vector<Function> functions_of(const std::string& source);

}  // namespace orbitfuse::structure
