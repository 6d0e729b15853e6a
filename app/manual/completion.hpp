// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace orbitfuse::manual {

/// A script that bash sources: completes verbs, each verb's options and the values of options with
/// a fixed set of them; everything else as file names.
std::string bash_completion(const CLI::App& app);

}  // namespace orbitfuse::manual
