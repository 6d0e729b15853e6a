// SPDX-License-Identifier: BSD-3-Clause
#include "core/system/parallel.hpp"

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <thread>

#include "core/system/trace.hpp"

namespace orbitfuse {
namespace {

int& configured_threads() {
  static int threads = 0;
  return threads;
}

std::unique_ptr<tbb::global_control>& control() {
  static std::unique_ptr<tbb::global_control> instance;
  return instance;
}

}  // namespace

void set_thread_count(int threads) {
  configured_threads() = std::max(0, threads);
  control() = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                    static_cast<std::size_t>(thread_count()));
}

int thread_count() {
  if (configured_threads() > 0) return configured_threads();
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void parallel_blocks(int count, int block, const std::function<void(int, int)>& fn) {
  if (count <= 0) return;
  const int blocks = (count + block - 1) / block;
  if (blocks == 1 || thread_count() == 1) {
    const TraceShare share;
    for (int b = 0; b < blocks; ++b) fn(b * block, std::min(count, (b + 1) * block));
    return;
  }
  tbb::parallel_for(0, blocks, [&](int b) {
    const TraceShare share;
    fn(b * block, std::min(count, (b + 1) * block));
  });
}

void parallel_for(int count, const std::function<void(int)>& fn) {
  parallel_blocks(count, 1, [&](int begin, int) { fn(begin); });
}

void parallel_tasks(const std::vector<std::function<void()>>& tasks) {
  std::atomic<std::size_t> next = 0;
  parallel_for(std::min(thread_count(), static_cast<int>(tasks.size())), [&](int) {
    for (std::size_t i = next++; i < tasks.size(); i = next++) tasks[i]();
  });
}

}  // namespace orbitfuse
