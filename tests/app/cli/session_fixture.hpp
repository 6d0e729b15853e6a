// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "core/session/session.hpp"

namespace orbitfuse {

struct FixtureOptions {
  int visible = 12, thermal = 12;  ///< views on one loop
  int width = 96, height = 72;
  bool known_poses = true;
  bool stations = true;
  double warmer_k = 0;  ///< than 290 to 310 K
};

/// Of known thermal poses so few are not held against renders: `poses` trains no field for them.
inline constexpr int few_thermal = 5;

/// A session of a coloured, heated box seen from an orbit, recorded by the real writer. Aborts the
/// test when it can't be written.
void write_fixture_session(const std::filesystem::path& folder, const FixtureOptions& options = {});

}  // namespace orbitfuse
