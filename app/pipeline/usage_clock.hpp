// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>

namespace orbitfuse::pipeline {

/// CPU seconds of this process and its finished children (COLMAP), and wall seconds, since start.
class UsageClock {
 public:
  UsageClock() : start_(std::chrono::steady_clock::now()), start_cpu_s_(total_cpu_s()) {}
  double cpu_s() const { return total_cpu_s() - start_cpu_s_; }
  double wall_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  static double total_cpu_s();
  std::chrono::steady_clock::time_point start_;
  double start_cpu_s_;
};

}  // namespace orbitfuse::pipeline
