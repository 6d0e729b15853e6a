// SPDX-License-Identifier: BSD-3-Clause
// How soon a GigE Vision camera's loss is told and its stream is back: bench_gev_recovery
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

#include "drivers/aravis/aravis_source.hpp"
#include "tests/support/gev_simulator.hpp"

namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using orbitfuse::Delivery;
using orbitfuse::aravis::AravisSource;
using orbitfuse::testing::GevFaults;
using orbitfuse::testing::GevSimulator;

struct Seen {
  Clock::time_point first_alarm{}, first_frame{};
  std::uint64_t first_id = 0;
};

/// Runs until the condition or the limit; notes the first alarm, and the first frame after it.
template <class Until>
Seen watch(AravisSource& source, std::chrono::milliseconds limit, const Until& until) {
  Seen seen;
  const auto end = Clock::now() + limit;
  while (Clock::now() < end && !until(seen)) {
    const auto delivery = source.next(200ms);
    if (!delivery) break;
    const bool alarm = delivery->kind == Delivery::Kind::event &&
                       (delivery->reason == "silent" || delivery->reason == "disconnected" ||
                        delivery->reason == "control-silent");
    if (alarm && seen.first_alarm == Clock::time_point{}) seen.first_alarm = Clock::now();
    if (delivery->kind != Delivery::Kind::frame) continue;
    if (seen.first_frame == Clock::time_point{}) seen.first_id = delivery->frame.id;
    seen.first_frame = seen.first_frame == Clock::time_point{} ? Clock::now() : seen.first_frame;
  }
  return seen;
}

double seconds(Clock::duration d) { return std::chrono::duration<double>(d).count(); }

struct Case {
  const char* name;
  double away_s;
  bool kill;
  GevFaults faults;
};

}  // namespace

int main() {
  std::vector<Case> cases{{"killed, restarted after 3 s", 3, true, {}},
                          {"link down 3 s", 3, false, {}},
                          {"link down 8 s", 8, false, {}},
                          {"GVCP mute 8 s", 8, false, {}}};
  cases[1].faults.link_down = cases[2].faults.link_down = true;
  cases[3].faults.mute_control = true;
  std::printf("%-28s %12s %16s %10s\n", "case", "flagged s", "streaming s", "id gap");
  for (const Case& c : cases) {
    GevSimulator camera;
    if (!camera.start()) {
      std::fputs("the GVCP port 3956 on the loopback is in use\n", stderr);
      return 1;
    }
    orbitfuse::aravis::AravisOptions options;
    options.camera = "127.0.0.1";
    AravisSource source(options);
    if (const auto status = source.start(); !status) {
      std::fprintf(stderr, "%s\n", status.error().message().c_str());
      return 1;
    }
    std::uint64_t last_id = 0;
    const auto settle = Clock::now() + 2s;
    while (Clock::now() < settle) {
      const auto delivery = source.next(200ms);
      if (delivery && delivery->kind == Delivery::Kind::frame) last_id = delivery->frame.id;
    }
    if (c.kill)
      camera.kill();
    else
      camera.set_faults(c.faults);
    const auto fault = Clock::now();
    const auto returns = fault + std::chrono::duration_cast<Clock::duration>(
                                     std::chrono::duration<double>(c.away_s));
    Seen away = watch(source, std::chrono::milliseconds(static_cast<int>(1000 * c.away_s)),
                      [&](const Seen&) { return Clock::now() >= returns; });
    if (c.kill)
      camera.start();
    else
      camera.set_faults({});
    const auto back = Clock::now();
    const Seen after =
        watch(source, 20s, [](const Seen& s) { return s.first_frame != Clock::time_point{}; });
    const bool told = away.first_alarm != Clock::time_point{};
    std::printf(
        "%-28s %12s %16.2f %10lld\n", c.name,
        told ? std::to_string(seconds(away.first_alarm - fault)).substr(0, 5).c_str() : "never",
        seconds(after.first_frame - back), static_cast<long long>(after.first_id - last_id) - 1);
  }
  return 0;
}
