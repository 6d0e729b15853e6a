// SPDX-License-Identifier: BSD-3-Clause
#include "core/system/trace.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "core/system/parallel.hpp"

namespace orbitfuse {
namespace {

void spend(int milliseconds) {
  std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
}

/// Complete events by name.
std::multimap<std::string, nlohmann::json> events() {
  std::multimap<std::string, nlohmann::json> found;
  const auto trace = nlohmann::json::parse(trace_json());
  for (const auto& event : trace.at("traceEvents"))
    if (event.at("ph") == "X") found.emplace(event.at("name"), event);
  return found;
}

TEST(Trace, KeepsNothingBeforeItIsStarted) {
  { const TraceSpan span("early"); }
  EXPECT_EQ(events().count("early"), 0u);
}

TEST(Trace, SpansNestOnTheirThread) {
  start_trace();
  {
    const TraceSpan outer("outer");
    spend(2);
    const TraceSpan inner("inner");
    spend(2);
  }
  std::thread([] { const TraceSpan span("elsewhere"); }).join();
  const auto found = events();
  ASSERT_EQ(found.count("outer"), 1u);
  ASSERT_EQ(found.count("inner"), 1u);
  ASSERT_EQ(found.count("elsewhere"), 1u);
  const auto &outer = found.find("outer")->second, &inner = found.find("inner")->second;
  EXPECT_EQ(outer["tid"], inner["tid"]);
  EXPECT_NE(outer["tid"], found.find("elsewhere")->second["tid"]);
  const double start = outer["ts"], end = start + outer["dur"].get<double>();
  EXPECT_GE(inner["ts"].get<double>(), start + 1e3) << "microseconds";
  EXPECT_LE(inner["ts"].get<double>() + inner["dur"].get<double>(), end + 1);
  EXPECT_TRUE(outer["args"].contains("cpu_s"));
}

TEST(Trace, SharesOfParallelWorkBecomeOneSpanAThread) {
  start_trace();
  const auto before = events().count("parallel work");
  parallel_for(1000, [](int) {
    // Nested work is its caller's.
    parallel_for(2, [](int) {});
  });
  const auto found = events();
  EXPECT_GT(found.count("parallel work"), before);
  std::set<int> threads;
  const auto [begin, end] = found.equal_range("parallel work");
  for (auto share = begin; share != end; ++share)
    threads.insert(share->second.at("tid").get<int>());
  EXPECT_LE(threads.size(), static_cast<std::size_t>(thread_count()));
}

/// On a machine that stops this thread for long at the wrong moment two shares stay two; not each
/// time.
TEST(Trace, SharesCloseToEachOtherAreOne) {
  start_trace();
  { const TraceShare first; }
  bool joined = false;
  for (int i = 0; i < 100 && !joined; ++i) {
    const auto before = events().count("parallel work");
    { const TraceShare next; }
    joined = events().count("parallel work") == before;
  }
  EXPECT_TRUE(joined);
  spend(10);
  const auto before = events().count("parallel work");
  { const TraceShare late; }
  EXPECT_EQ(events().count("parallel work"), before + 1);
}

}  // namespace
}  // namespace orbitfuse
