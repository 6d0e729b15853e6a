// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/interrupt.hpp"

#include <unistd.h>

#include <csignal>

#include "app/terminal/exit_code.hpp"

namespace orbitfuse::terminal {
namespace {

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set in a signal handler");

void on_signal(int) {
  if (interrupted.exchange(true)) _exit(exit_interrupted);
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
  signal(SIGPIPE, SIG_IGN);
}

}  // namespace orbitfuse::terminal
