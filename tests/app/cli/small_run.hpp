// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace orbitfuse {

/// Words of the program that make a small run of a session in seconds, to measure in. Small tables:
/// the session has few pixels, and whatever reads the fields reads them whole.
std::vector<std::string> small_run(const std::filesystem::path& session,
                                   const std::filesystem::path& out);

struct MadeRun {
  std::filesystem::path session, out;
};

/// A small run of the fixture's session, the object warmer by so much. It is made when the program
/// first asks for it, stays until the program ends, and is not to be written to.
const MadeRun& made_run(double warmer_k = 0);

/// A copy of its results, to write to.
void copy_results(const MadeRun& run, const std::filesystem::path& to);

}  // namespace orbitfuse
