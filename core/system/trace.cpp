// SPDX-License-Identifier: BSD-3-Clause
#include "core/system/trace.hpp"

#include <atomic>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "core/system/clock.hpp"

namespace orbitfuse {
namespace {

constexpr double same_share_s = 0.002;

struct Event {
  std::string name;
  double start_s = 0, end_s = 0;
  std::optional<double> cpu_s = {};  ///< of the whole process; of shares not measured
};

/// One thread's; only that thread writes it.
struct Track {
  std::vector<Event> spans, shares;
  int open_shares = 0;  ///< a share within a share is the outer one's
};

struct Recorder {
  std::atomic<bool> on = false;
  double start_s = 0;
  std::mutex mutex;  ///< of the list
  std::vector<std::unique_ptr<Track>> tracks;
};

Recorder& recorder() {
  static Recorder instance;
  return instance;
}

Track& own_track() {
  thread_local Track* track = [] {
    Recorder& all = recorder();
    const std::lock_guard lock(all.mutex);
    return all.tracks.emplace_back(std::make_unique<Track>()).get();
  }();
  return *track;
}

}  // namespace

void start_trace() {
  recorder().start_s = wall_seconds();
  (void)own_track();  // the caller's is the first
  recorder().on.store(true, std::memory_order_relaxed);
}

bool tracing() { return recorder().on.load(std::memory_order_relaxed); }

TraceSpan::TraceSpan(std::string_view name, std::string_view detail) {
  if (!tracing()) return;
  name_ = name;
  if (!detail.empty()) name_.append(" ").append(detail);
  start_s_ = wall_seconds();
  cpu_start_s_ = cpu_seconds();
}

TraceSpan::~TraceSpan() {
  if (!start_s_) return;
  own_track().spans.push_back(
      {std::move(name_), *start_s_, wall_seconds(), cpu_seconds() - cpu_start_s_});
}

TraceShare::TraceShare() {
  if (tracing() && own_track().open_shares++ == 0) start_s_ = wall_seconds();
}

TraceShare::~TraceShare() {
  if (!tracing()) return;
  Track& track = own_track();
  if (track.open_shares > 0) --track.open_shares;
  if (!start_s_) return;
  const double now_s = wall_seconds();
  if (!track.shares.empty() && *start_s_ - track.shares.back().end_s < same_share_s)
    track.shares.back().end_s = now_s;
  else
    track.shares.push_back({"parallel work", *start_s_, now_s});
}

std::string trace_json() {
  Recorder& all = recorder();
  const std::lock_guard lock(all.mutex);
  auto events = nlohmann::json::array();
  const auto label = [&](int tid, const std::string& text) {
    events.push_back({{"ph", "M"},
                      {"name", "thread_name"},
                      {"pid", 1},
                      {"tid", tid},
                      {"args", {{"name", text}}}});
  };
  const auto add = [&](const Event& event, int tid) {
    nlohmann::json line = {{"ph", "X"},
                           {"name", event.name},
                           {"pid", 1},
                           {"tid", tid},
                           {"ts", 1e6 * (event.start_s - all.start_s)},
                           {"dur", 1e6 * (event.end_s - event.start_s)}};
    if (event.cpu_s) line["args"] = {{"cpu_s", *event.cpu_s}};
    events.push_back(std::move(line));
  };
  for (std::size_t i = 0; i < all.tracks.size(); ++i) {
    const Track& track = *all.tracks[i];
    const int spans = static_cast<int>(2 * i), shares = spans + 1;
    if (!track.spans.empty()) label(spans, i == 0 ? "stages" : "thread " + std::to_string(i));
    if (!track.shares.empty()) label(shares, "worker " + std::to_string(i));
    for (const Event& event : track.spans) add(event, spans);
    for (const Event& event : track.shares) add(event, shares);
  }
  return nlohmann::json{{"displayTimeUnit", "ms"}, {"traceEvents", std::move(events)}}.dump() +
         "\n";
}

}  // namespace orbitfuse
