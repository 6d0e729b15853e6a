// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace orbitfuse {

/// Words of the program that make a small run of a session in seconds, to measure in.
inline std::vector<std::string> small_run(const std::filesystem::path& session,
                                          const std::filesystem::path& out) {
  std::vector<std::string> words = {"run", session.string(), "--out", out.string()};
  for (const char* set : {"train.visible.iterations=300", "train.thermal.iterations=300",
                          "train.visible.eval_count=0", "train.thermal.eval_count=0",
                          "render.views=2", "render.width_px=64", "fuse.methods=[\"heat\"]"})
    words.insert(words.end(), {"--set", set});
  return words;
}

}  // namespace orbitfuse
