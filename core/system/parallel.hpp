// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

namespace orbitfuse {

/// Threads that parallel_for may use; 0 = all cores. Of the whole process: set it before
/// anything runs, in main(), a test or a program that uses the libraries.
void set_thread_count(int threads);
int thread_count();

/// fn(begin, end) over [0, count) in blocks of `block`. Block bounds do not depend on the thread
/// count, so per-block results are the same for any number of threads.
void parallel_blocks(int count, int block, const std::function<void(int begin, int end)>& fn);

/// fn(i) for i in [0, count), one task each.
void parallel_for(int count, const std::function<void(int)>& fn);

/// Tasks of different lengths, begun in this order: with the longest first, threads end together.
void parallel_tasks(const std::vector<std::function<void()>>& tasks);

}  // namespace orbitfuse
