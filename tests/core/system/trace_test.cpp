// SPDX-License-Identifier: BSD-3-Clause
#include "core/system/trace.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
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
  const auto after = events().count("parallel work");
  EXPECT_GT(after, before);
  EXPECT_LE(after - before, static_cast<std::size_t>(thread_count()));
}

}  // namespace
}  // namespace orbitfuse
