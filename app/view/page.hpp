// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace orbitfuse::view {

/// The page with its style, its scripts and three.js in it: it asks nobody for anything.
std::string page_html();

}  // namespace orbitfuse::view
