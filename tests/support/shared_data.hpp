// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdlib>
#include <filesystem>

namespace orbitfuse::testing {

/// The shared development data: $ORBITFUSE_SHARED, else ../shared beside the checkout. Tests that
/// need it skip when it is absent.
inline std::filesystem::path shared_data() {
  if (const char* folder = std::getenv("ORBITFUSE_SHARED"))
    return std::filesystem::path(folder) / "data";
  return std::filesystem::path(ORBITFUSE_SOURCE_DIR).parent_path() / "shared" / "data";
}

}  // namespace orbitfuse::testing
