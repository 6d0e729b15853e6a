// SPDX-License-Identifier: BSD-3-Clause
// Every seed, thousands of damaged ones, and every input that was ever found at fault: no reader
// may crash. Under the address sanitizer (preset asan) this also finds reads beyond the end.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <random>

#include "core/system/file_io.hpp"
#include "tests/fuzz/targets.hpp"

namespace orbitfuse::fuzz {
namespace {

/// One of the ways in which files get damaged; the same for the same seed.
std::string damaged(std::string bytes, std::mt19937& random) {
  if (bytes.empty()) return bytes;
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  const std::size_t changes = 1 + below(4);
  for (std::size_t i = 0; i < changes && !bytes.empty(); ++i) {
    const std::size_t at = below(bytes.size());
    switch (below(6)) {
      case 0:
        bytes[at] = static_cast<char>(random());
        break;
      case 1:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8)));
        break;
      case 2:
        bytes.resize(at);
        break;
      case 3:
        bytes.insert(at, bytes.substr(below(bytes.size()), 1 + below(40)));
        break;
      case 4:
        bytes.erase(at, 1 + below(40));
        break;
      default:
        for (std::size_t k = at; k < std::min(bytes.size(), at + 4); ++k)
          bytes[k] = static_cast<char>(below(2) ? 0xff : 0);
    }
  }
  return bytes;
}

void run_all(const std::vector<Target>& targets) {
  namespace fs = std::filesystem;
  for (const Target& target : targets) {
    SCOPED_TRACE(target.name);
    std::mt19937 random(7);
    const auto seeds = target.seeds();
    ASSERT_FALSE(seeds.empty());
    for (const std::string& seed : seeds) {
      target.run(seed);
      for (int i = 0; i < FUZZ_MUTANTS; ++i) target.run(damaged(seed, random));
    }
    const fs::path found = fs::path(ORBITFUSE_SOURCE_DIR) / "tests/fuzz/cases" / target.name;
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(found, none)) {
      SCOPED_TRACE(entry.path().string());
      target.run(read_file(entry.path()).value());
    }
  }
}

TEST(FuzzCases, Images) { run_all(image_targets()); }
TEST(FuzzCases, Formats) { run_all(format_targets()); }
TEST(FuzzCases, Live) { run_all(live_targets()); }
TEST(FuzzCases, Fields) { run_all(field_targets()); }

}  // namespace
}  // namespace orbitfuse::fuzz
