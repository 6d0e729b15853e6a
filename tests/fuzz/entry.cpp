// SPDX-License-Identifier: BSD-3-Clause
// What libFuzzer calls. One program holds the targets of one list; the name it was started under, a
// link to it, says which: fuzz_tiff.run runs the target "tiff". `fuzz_tiff.run --write-seeds
// FOLDER` writes the seeds and stops; any other name lists the targets.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "core/system/parallel.hpp"
#include "tests/fuzz/targets.hpp"

namespace {
const orbitfuse::fuzz::Target* chosen = nullptr;
}

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  using namespace orbitfuse::fuzz;
  const std::string name = std::filesystem::path((*argv)[0]).filename().string();
  const auto at = name.find("fuzz_");
  const auto end = name.rfind(".run");
  if (at != std::string::npos && end != std::string::npos)
    chosen = find(FUZZ_TARGETS(), name.substr(at + 5, end - at - 5));
  if (!chosen) {
    for (const Target& target : FUZZ_TARGETS()) std::printf("%s\n", target.name);
    std::exit(2);
  }
  orbitfuse::set_thread_count(1);
  if (*argc == 3 && std::string((*argv)[1]) == "--write-seeds") {
    int index = 0;
    std::filesystem::create_directories((*argv)[2]);
    for (const std::string& seed : chosen->seeds())
      std::ofstream(std::string((*argv)[2]) + "/seed" + std::to_string(index++), std::ios::binary)
          << seed;
    std::exit(0);
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  chosen->run({reinterpret_cast<const char*>(data), size});
  return 0;
}
