// SPDX-License-Identifier: BSD-3-Clause
#include "capture/live/turntable.hpp"

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

double Turntable::photo(TableView& view) const {
  if (keys_ == 0) view.counts_photos = true;
  return azimuth_deg(view.counts_photos ? ++view.photos : keys_);
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

std::size_t Turntable::turn_after_step(const TableView& view) const {
  return whole_turns(view.turned_deg + std::abs(step_deg_));
}

}  // namespace orbitfuse
