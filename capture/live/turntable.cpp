// SPDX-License-Identifier: BSD-3-Clause
#include "capture/live/turntable.hpp"

#include <algorithm>
#include <cmath>

namespace orbitfuse {
namespace {

// Seven sevenths of 360 degrees are a turn, also where a manifest rounded them.
constexpr double same_place_deg = 1e-3;

double wrapped_deg(double degrees) {
  double within = std::fmod(degrees, 360);
  if (within < 0) within += 360;
  return within > 360 - same_place_deg ? 0 : within;
}

std::size_t whole_turns(double degrees) {
  return static_cast<std::size_t>((degrees + same_place_deg) / 360);
}

}  // namespace

double Turntable::azimuth_deg(int count) const {
  return wrapped_deg(base_deg_ + (steps_before_ + count) * step_deg_);
}

/// In the direction in which the table turns, 0..360.
double Turntable::way_deg(double from_deg, double to_deg) const {
  return wrapped_deg(step_deg_ < 0 ? from_deg - to_deg : to_deg - from_deg);
}

int Turntable::key(std::int64_t time_ns) {
  // A host clock that was set back must not put this key before the one it follows.
  if (!key_times_ns_.empty()) time_ns = std::max(time_ns, key_times_ns_.back());
  key_times_ns_.push_back(time_ns);
  return keys();
}

std::optional<int> Turntable::key_before(std::int64_t photo_ns) const {
  constexpr std::int64_t second_ns = 1'000'000'000;
  const auto count_until = [this](std::int64_t time_ns) {
    return static_cast<int>(std::upper_bound(key_times_ns_.begin(), key_times_ns_.end(), time_ns) -
                            key_times_ns_.begin());
  };
  const int key = count_until(photo_ns);
  const std::int64_t latest_ns = photo_ns % second_ns == 0 ? photo_ns + second_ns - 1 : photo_ns;
  if (key == 0 || count_until(latest_ns) != key) return std::nullopt;
  return key;
}

void Turntable::resume_at(TableView& view, const Station& station) {
  base_deg_ = wrapped_deg(station.azimuth_deg);
  steps_before_ = 0;
  if (!view.start_deg) view.start_deg = base_deg_;
  view.turned_deg = 360.0 * station.loop + way_deg(*view.start_deg, base_deg_);
}

std::size_t Turntable::turn(TableView& view, double azimuth_deg) const {
  if (!view.start_deg) view.start_deg = azimuth_deg;
  view.turned_deg += way_deg(
      wrapped_deg(*view.start_deg + std::copysign(view.turned_deg, step_deg_)), azimuth_deg);
  return whole_turns(view.turned_deg);
}

std::size_t Turntable::turn_at_key(TableView& view, int key) const {
  if (!view.key) {
    view.key = key;
    return turn(view, azimuth_deg(key));
  }
  view.turned_deg += (key - *view.key) * std::abs(step_deg_);
  view.key = key;
  if (view.turned_deg < 0) {
    view.turned_deg = 0;
    view.start_deg = azimuth_deg(key);
  }
  return whole_turns(view.turned_deg);
}

std::size_t Turntable::turn_after_step(const TableView& view) const {
  return whole_turns(view.turned_deg + std::abs(step_deg_));
}

}  // namespace orbitfuse
