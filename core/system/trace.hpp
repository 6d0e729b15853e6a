// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>

// Where the time of a run goes, as a picture: spans by thread in Chrome's trace format ("Trace
// Event Format", complete events), which chrome://tracing, Perfetto and speedscope show. Costs one
// relaxed load a span until start_trace() is called.
namespace orbitfuse {

/// Keeps spans from now on. Once, before threads work.
void start_trace();
bool tracing();

/// From its construction to its end, on the thread that made it; spans of a thread nest.
class TraceSpan {
 public:
  /// "NAME" or "NAME DETAIL".
  explicit TraceSpan(std::string_view name, std::string_view detail = {});
  ~TraceSpan();
  TraceSpan(const TraceSpan&) = delete;
  TraceSpan& operator=(const TraceSpan&) = delete;

 private:
  std::string name_;
  std::optional<double> start_s_;  ///< absent: nobody traces
  double cpu_start_s_ = 0;
};

/// A thread's share of parallel work. Shares less than 2 ms apart become one span, so that a
/// training's hundred thousand blocks stay readable.
class TraceShare {
 public:
  TraceShare();
  ~TraceShare();
  TraceShare(const TraceShare&) = delete;
  TraceShare& operator=(const TraceShare&) = delete;

 private:
  std::optional<double> start_s_;  ///< absent: nobody traces, or a share within a share
};

/// All spans so far: {"traceEvents": [...]}. While no thread adds any.
std::string trace_json();

}  // namespace orbitfuse
