// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace orbitfuse::report {

// Contents of assets/, put into the program by CMake.
extern const char* const report_css;
extern const char* const report_js;

}  // namespace orbitfuse::report
