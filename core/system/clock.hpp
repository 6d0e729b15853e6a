// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace orbitfuse {

/// CPU seconds, user and system, that this process and its finished children (COLMAP) have used,
/// over all threads. Only differences mean something.
double cpu_seconds();

/// Seconds of a clock that is never set back. Only differences mean something.
double wall_seconds();

/// What has been used since its construction.
class UsageClock {
 public:
  double cpu_s() const { return cpu_seconds() - start_cpu_s_; }
  double wall_s() const { return wall_seconds() - start_wall_s_; }

 private:
  double start_cpu_s_ = cpu_seconds(), start_wall_s_ = wall_seconds();
};

}  // namespace orbitfuse
