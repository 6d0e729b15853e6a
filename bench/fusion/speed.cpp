// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "bench/fusion/modes.hpp"
#include "core/system/cpu.hpp"
#include "core/system/parallel.hpp"
#include "fusion/metrics/metrics.hpp"

namespace orbitfuse::bench {
namespace {

constexpr const char* in_child = "ORBITFUSE_BENCH_FUSION_CHILD";

void print_row(const std::string& what, const Times& times) {
  fmt::print("| {} | {} | {:.1f} | {:.1f} |\n", what, name(best_isa()), times.wall_ms,
             times.cpu_ms);
  std::fflush(stdout);
}

/// This program again with AVX2 as the best instruction set; waits for it.
int repeat_for_avx2(const std::filesystem::path& folder, const char* program) {
  setenv("ORBITFUSE_ISA", "avx2", 1);
  setenv(in_child, "1", 1);
  std::string self = program, mode = "--speed", data = folder.string();
  char* arguments[] = {self.data(), mode.data(), data.data(), nullptr};
  pid_t child = 0;
  int status = 0;
  if (posix_spawn(&child, program, nullptr, nullptr, arguments, environ) != 0 ||
      waitpid(child, &status, 0) != child) {
    fmt::print(stderr, "{}: cannot be started again\n", program);
    return 4;
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 4;
}

}  // namespace

int speed(const std::filesystem::path& folder, const char* program) {
  const bool child = std::getenv(in_child) != nullptr;
  const Pair pair = timed_pair(load_pairs(folder));
  if (!child)
    fmt::print(
        "{}, {} threads used, one 640x480 gray pair, least of 60 runs\n\n"
        "| what | instructions | wall ms | CPU ms |\n|---|---|---|---|\n",
        cpu_description(), thread_count());
  for (const std::string& method : scored_methods()) {
    FusionOptions options;
    options.method = fusion_method(method).value();
    print_row(method, times_of(60, [&] { fuse(pair.visible, pair.thermal, {}, options).value(); }));
  }
  const cv::Mat fused = fuse(pair.visible, pair.thermal, {}, {}).value();
  print_row("metrics, all",
            times_of(20, [&] { fusion_metrics(pair.visible, pair.thermal, fused).value(); }));
  return child ? 0 : repeat_for_avx2(folder, program);
}

}  // namespace orbitfuse::bench
