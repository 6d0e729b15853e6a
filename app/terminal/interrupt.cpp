// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/interrupt.hpp"

#include <unistd.h>

#include <csignal>
#include <ctime>

#include "app/terminal/exit_code.hpp"

namespace orbitfuse::terminal {
namespace {

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set in a signal handler");

std::atomic<long long> first_ms{0};
static_assert(std::atomic<long long>::is_always_lock_free, "set in a signal handler");

/// One wish may come twice: Slurm signals every process of a job, and the farm in it passes the
/// signal on to its stage. Taken for a second one it would cost the checkpoint.
constexpr long long same_wish_ms = 1000;

long long now_ms() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return 1000LL * now.tv_sec + now.tv_nsec / 1'000'000;
}

void on_signal(int) {
  long long first = 0;
  const long long now = now_ms();
  if (!first_ms.compare_exchange_strong(first, now)) {
    if (now - first > same_wish_ms) _exit(exit_interrupted);
    return;
  }
  interrupted.store(true);
  constexpr char text[] = "\nstopping; what is done so far is kept (again to stop at once)\n";
  (void)!write(STDERR_FILENO, text, sizeof text - 1);
}

}  // namespace

const std::atomic<bool>& interrupt_flag() { return interrupted; }

void install_interrupt_handler() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  sigemptyset(&action.sa_mask);
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  // A terminal that goes away (ssh, a closed lid) ends a recording as Ctrl-C does. Under nohup it
  // is to go on.
  struct sigaction hangup {};
  sigaction(SIGHUP, nullptr, &hangup);
  if (hangup.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);
  signal(SIGPIPE, SIG_IGN);
}

}  // namespace orbitfuse::terminal
