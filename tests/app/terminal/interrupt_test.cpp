// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/interrupt.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <functional>
#include <thread>

namespace orbitfuse::terminal {
namespace {

constexpr int goes_on = 7, not_told = 8;

/// Exit code of a process of its own that does this under the handler.
int code_of(const std::function<void()>& signals) {
  const pid_t child = fork();
  if (child == 0) {
    signal(SIGHUP, SIG_DFL);  // the tests may run under nohup
    install_interrupt_handler();
    signals();
    _exit(interrupt_flag() ? goes_on : not_told);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

/// bash does so when its terminal goes away.
TEST(Interrupt, AHangupThatComesTwiceAtOnceIsOneWish) {
  EXPECT_EQ(code_of([] {}), not_told);
  EXPECT_EQ(code_of([] {
              raise(SIGHUP);
              raise(SIGHUP);
            }),
            goes_on);
}

TEST(Interrupt, ASecondSignalAfterAWhileEndsTheProcess) {
  EXPECT_EQ(code_of([] {
              raise(SIGINT);
              std::this_thread::sleep_for(std::chrono::milliseconds(1200));
              raise(SIGINT);
            }),
            130);
}

}  // namespace
}  // namespace orbitfuse::terminal
