// SPDX-License-Identifier: BSD-3-Clause
// bench_fusion [FOLDER] : every method and knob on the reference pairs (default
// ../shared/data/fusion):
//   mean Qabf, Qcb, Qcv and SSIM beside the references', and milliseconds for a 640x480 pair.
// bench_fusion --methods : the four methods at their defaults only.
// bench_fusion --speed : wall and CPU time of methods and metrics, for the best instructions and
// AVX2. bench_fusion --skipping : what each method skips on each pair, and what that loses.
// bench_fusion --cross : constants of `best` chosen on half of the pairs, scored on the others.
// bench_fusion --halo : what keeps `best` from halos, chosen by cross-validation; made scenes.
// bench_fusion --out DIR : with the first two also DIR/fusion.json and DIR/curves/fusion_knobs.svg.
#include <fmt/format.h>

#include <cstdio>
#include <string>

#include "bench/fusion/modes.hpp"
#include "core/system/cpu.hpp"
#include "core/system/memory.hpp"
#include "core/system/parallel.hpp"

int main(int argc, char** argv) {
  using namespace orbitfuse;
  keep_freed_memory();
  std::filesystem::path folder = "../shared/data/fusion", out;
  std::string mode;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--out" && i + 1 < argc)
      out = argv[++i];
    else if (word.starts_with("--"))
      mode = word;
    else
      folder = word;
  }
  if (mode == "--speed") return bench::speed(folder, argv[0]);
  fmt::print("{}, {} threads used\n\n", cpu_description(), thread_count());
  if (mode == "--skipping") return bench::skipping(folder);
  if (mode == "--cross") return bench::cross_check(folder);
  if (mode == "--halo") return bench::halos(folder);
  if (mode.empty() || mode == "--methods") return bench::sweep(folder, mode.empty(), out);
  fmt::print(stderr, "{}: unknown; one of --methods, --speed, --skipping, --cross, --halo\n", mode);
  return 2;
}
