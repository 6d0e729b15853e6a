// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include "app/terminal/exit_code.hpp"

// Compiled for any x86-64 processor, unlike all other sources: on one without AVX2 even their
// static initialisers would end in SIGILL, and nobody would be told why.
namespace {

constexpr char message[] =
    "error: this processor has no AVX2 (x86-64-v3); use Intel's from 2013 or AMD's from 2015 on\n";

/// 101 is the first priority that is not the compiler's own: before every other initialiser of
/// ours.
__attribute__((constructor(101))) void check_processor() {
  __builtin_cpu_init();
  if (__builtin_cpu_supports("x86-64-v3")) return;
  if (::write(STDERR_FILENO, message, sizeof message - 1) < 0) {
    // Nobody listens; the exit code tells it still.
  }
  ::_exit(orbitfuse::terminal::exit_unavailable);
}

}  // namespace
