// SPDX-License-Identifier: BSD-3-Clause
// How soon a GigE Vision camera's loss is told and its stream is back, how often it is opened for
// that, and whether the account is right: bench_gev_recovery [times]
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "drivers/aravis/aravis_source.hpp"
#include "tests/support/gev_simulator.hpp"

namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using orbitfuse::Delivery;
using orbitfuse::EventKind;
using orbitfuse::aravis::AravisSource;
using orbitfuse::testing::GevFaults;
using orbitfuse::testing::GevOptions;
using orbitfuse::testing::GevSimulator;

double seconds(Clock::duration d) { return std::chrono::duration<double>(d).count(); }

struct Case {
  const char* name;
  double away_s;
  bool enforce, kill;
  GevFaults faults;
};

GevFaults fault(bool GevFaults::*which) {
  GevFaults faults;
  faults.*which = true;
  return faults;
}

/// What one outage looked like.
struct Outage {
  std::optional<double> told_s, back_s;  ///< after the fault, after the camera's return
  int reconnections = 0;
  std::uint64_t ids_missing = 0;
  bool account_right = false;  ///< ids keep the camera's numbers, or fit the time it was away
};

/// The simulator's frame number less the id, modulo 4001: the same as long as no id is made up or
/// left out. Counts of unknown scale travel beside their gray picture.
std::uint64_t shift_of(const orbitfuse::Frame& frame) {
  const cv::Mat& counts = frame.original.empty() ? frame.pixels : frame.original;
  if (counts.type() != CV_16UC1) return 4001;
  const std::uint16_t first = counts.at<std::uint16_t>(0, 0);
  for (std::uint64_t number = 0; number < 4001; ++number) {
    if (GevSimulator::pixel(number, 0) == first) return (number + 4001 - frame.id % 4001) % 4001;
  }
  return 4001;
}

class Watcher {
 public:
  explicit Watcher(AravisSource& source) : source_(source) {}

  /// Takes what comes until then.
  void until(Clock::time_point end) {
    while (Clock::now() < end) take();
  }
  void take() {
    const auto delivery = source_.next(50ms);
    if (!delivery) return;
    if (delivery->kind == Delivery::Kind::event) {
      const EventKind kind = delivery->event;
      const bool alarm = kind == EventKind::silent || kind == EventKind::disconnected ||
                         kind == EventKind::control_silent;
      if (alarm && !alarm_at) alarm_at = Clock::now();
      reconnections += kind == EventKind::reconnected;
      return;
    }
    if (delivery->kind != Delivery::Kind::frame) return;
    last_id = delivery->frame.id;
    last_at = Clock::now();
    shift = shift_of(delivery->frame);
    if (reconnections > 0 && !back_at) {
      back_at = last_at;
      first_id = last_id;
    }
  }

  std::optional<Clock::time_point> alarm_at, back_at;
  Clock::time_point last_at{};
  std::uint64_t last_id = 0, first_id = 0, shift = 4001;
  int reconnections = 0;

 private:
  AravisSource& source_;
};

std::optional<Outage> run(const Case& c) {
  GevOptions camera_options;
  camera_options.enforce_control = c.enforce;
  GevSimulator camera(camera_options);
  if (!camera.start_when_free()) return std::nullopt;
  orbitfuse::aravis::AravisOptions options;
  options.camera = "127.0.0.1";
  AravisSource source(options);
  if (!source.start()) return std::nullopt;
  Watcher watcher(source);
  watcher.until(Clock::now() + 1500ms);
  const std::uint64_t shift_before = watcher.shift;
  if (c.kill)
    camera.kill();
  else
    camera.set_faults(c.faults);
  const auto gone = Clock::now();
  // Frames may still come at first (a mute camera's do): what counts is the last one before.
  std::uint64_t last_id = watcher.last_id;
  auto last_at = watcher.last_at;
  while (Clock::now() < gone + std::chrono::duration<double>(c.away_s)) {
    watcher.take();
    if (watcher.reconnections == 0) {
      last_id = watcher.last_id;
      last_at = watcher.last_at;
    }
  }
  if (c.kill)
    camera.start_when_free();
  else
    camera.set_faults({});
  const auto returned = Clock::now();
  watcher.until(returned + 5s);
  Outage outage;
  if (watcher.alarm_at) outage.told_s = seconds(*watcher.alarm_at - gone);
  outage.reconnections = watcher.reconnections;
  if (!watcher.back_at) return outage;
  outage.back_s = seconds(*watcher.back_at - returned);
  outage.ids_missing = watcher.first_id - last_id - 1;
  const double by_time = seconds(*watcher.back_at - last_at) * camera_options.rate_hz - 1;
  outage.account_right =
      (watcher.shift == shift_before && watcher.shift < 4001) ||
      (c.kill && std::abs(static_cast<double>(outage.ids_missing) - by_time) < 4);
  return outage;
}

}  // namespace

int main(int argc, char** argv) {
  const int times = argc > 1 ? std::max(1, std::atoi(argv[1])) : 1;
  const std::vector<Case> cases{
      {"restarted after 3 s", 3, true, true, {}},
      {"link down 3 s", 3, true, false, fault(&GevFaults::link_down)},
      {"link down 8 s", 8, true, false, fault(&GevFaults::link_down)},
      {"mute 8 s", 8, true, false, fault(&GevFaults::mute_control)},
      {"unowned: frozen 3 s", 3, false, false, fault(&GevFaults::freeze)},
      {"unowned: stalled 1.5 s", 1.5, false, false, fault(&GevFaults::stall)},
      {"unowned: mute 8 s", 8, false, false, fault(&GevFaults::mute_control)},
      {"unowned: restarted after 3 s", 3, false, true, {}}};
  std::printf("%d times each; unowned: a camera that obeys whoever writes\n", times);
  std::printf("%-30s %10s %10s %14s %12s %14s\n", "case", "told s", "back s", "reconnections",
              "ids missing", "account right");
  bool good = true;
  for (const Case& c : cases) {
    double told = 0, back = 0;
    int most = 0, right = 0, came = 0, once = 0;
    std::uint64_t fewest_ids = ~0ull, most_ids = 0;
    for (int i = 0; i < times; ++i) {
      const std::optional<Outage> outage = run(c);
      if (!outage) {
        std::fputs("the GVCP port 3956 on the loopback is in use\n", stderr);
        return 1;
      }
      told = std::max(told, outage->told_s.value_or(99));
      back = std::max(back, outage->back_s.value_or(99));
      came += outage->back_s.has_value();
      most = std::max(most, outage->reconnections);
      once += outage->reconnections == 1;
      right += outage->account_right;
      fewest_ids = std::min(fewest_ids, outage->ids_missing);
      most_ids = std::max(most_ids, outage->ids_missing);
    }
    std::printf("%-30s %10.2f %10.2f %8d of %2d %6llu-%llu %8d of %2d%s\n", c.name, told, back,
                once, times, static_cast<unsigned long long>(fewest_ids),
                static_cast<unsigned long long>(most_ids), right, times,
                came == times ? "" : "  NOT BACK");
    std::fflush(stdout);
    good = good && came == times && once == times && right == times && back < 3;
  }
  return good ? 0 : 1;
}
