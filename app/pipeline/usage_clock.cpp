// SPDX-License-Identifier: BSD-3-Clause
#include "app/pipeline/usage_clock.hpp"

#include <sys/resource.h>

namespace orbitfuse::pipeline {

double UsageClock::total_cpu_s() {
  double total = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    getrusage(who, &usage);
    for (const timeval& t : {usage.ru_utime, usage.ru_stime})
      total += static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  }
  return total;
}

}  // namespace orbitfuse::pipeline
