// SPDX-License-Identifier: BSD-3-Clause
#include "capture/clock/clock_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "capture/frame_source.hpp"

namespace orbitfuse {
namespace {

constexpr double ns = 1e-9;
/// Below this spread of device times a slope means nothing.
constexpr double min_span_s = 2.0;
/// Crystal oscillators stay within 200 ppm; a steeper slope is noise.
constexpr double max_drift = 500e-6;

}  // namespace

ClockMap::ClockMap(ClockMapOptions options) : options_(options) {}

void ClockMap::begin_segment(std::int64_t device_ns, std::int64_t arrival_ns) {
  samples_.clear();
  suspects_.clear();
  device_origin_ns_ = device_ns;
  host_origin_ns_ = arrival_ns;
  intercept_s_ = 0;
  rate_ = 1;
  residual_rms_s_ = 0;
}

ClockMap::Stamp ClockMap::add(std::optional<std::int64_t> device_stamp_ns,
                              std::int64_t arrival_ns) {
  Stamp stamp;
  const auto finish = [&](std::int64_t host_ns) {
    last_host_ns_ = std::max(host_ns, last_host_ns_ + 1);
    stamp.host_time_ns = last_host_ns_;
    return stamp;
  };
  if (!device_stamp_ns || *device_stamp_ns <= 0 || *device_stamp_ns > latest_stamp_ns)
    return finish(arrival_ns);
  const std::int64_t device_ns = *device_stamp_ns;
  if (samples_.empty()) begin_segment(device_ns, arrival_ns);

  const double device_s = static_cast<double>(device_ns - device_origin_ns_) * ns;
  const double arrival_s = static_cast<double>(arrival_ns - host_origin_ns_) * ns;
  const double late_s = arrival_s - predicted_s(device_s);
  const bool backward = !samples_.empty() && device_ns < last_device_ns_;
  if (!samples_.empty() && (backward || std::abs(late_s) > options_.jump_s)) {
    suspects_.emplace_back(device_ns, arrival_ns);
    if (static_cast<int>(suspects_.size()) < options_.jump_frames) {
      // A frame that was merely held up: the fit knows better than its arrival.
      return finish(backward ? arrival_ns : std::min(arrival_ns, host_of(device_s)));
    }
    char text[64];
    std::snprintf(text, sizeof text, "clock jumped by %.3f s", -late_s);
    stamp.event = text;
    ++jumps_;
    const auto suspects = suspects_;
    begin_segment(suspects.front().first, suspects.front().second);
    for (const auto& [d, a] : suspects) {
      samples_.push_back({static_cast<double>(d - device_origin_ns_) * ns,
                          static_cast<double>(a - host_origin_ns_) * ns});
    }
  } else {
    suspects_.clear();
    samples_.push_back({device_s, arrival_s});
  }
  last_device_ns_ = device_ns;
  while (samples_.size() > 2 &&
         samples_.back().device_s - samples_.front().device_s > options_.window_s) {
    samples_.pop_front();
  }
  fit();
  // No frame is taken after it arrived.
  return finish(
      std::min(arrival_ns, host_of(static_cast<double>(device_ns - device_origin_ns_) * ns)));
}

std::int64_t ClockMap::host_of(double device_s) const {
  return host_origin_ns_ + static_cast<std::int64_t>(std::llround(predicted_s(device_s) / ns));
}

/// Least squares through the earliest arrival of each of 16 equal slices of the window, then an
/// intercept that no arrival precedes.
void ClockMap::fit() {
  const double first = samples_.front().device_s, span = samples_.back().device_s - first;
  constexpr int slices = 16;
  std::optional<Sample> best[slices];
  for (const Sample& s : samples_) {
    // After a step the first few frames may be in any order, and far apart.
    const double place = span > 0 ? slices * (s.device_s - first) / span : 0;
    const int slice = static_cast<int>(std::clamp(place, 0.0, slices - 1.0));
    if (!best[slice] || s.arrival_s - s.device_s < best[slice]->arrival_s - best[slice]->device_s)
      best[slice] = s;
  }
  double n = 0, mean_x = 0, mean_y = 0, sxx = 0, sxy = 0;
  for (const auto& s : best) {
    if (!s) continue;
    n += 1;
    mean_x += s->device_s;
    mean_y += s->arrival_s - s->device_s;
  }
  mean_x /= n;
  mean_y /= n;
  for (const auto& s : best) {
    if (!s) continue;
    sxx += (s->device_s - mean_x) * (s->device_s - mean_x);
    sxy += (s->device_s - mean_x) * (s->arrival_s - s->device_s - mean_y);
  }
  rate_ =
      span < min_span_s ? 1.0 : 1.0 + std::clamp(sxx > 0 ? sxy / sxx : 0.0, -max_drift, max_drift);
  double earliest = INFINITY, squares = 0;
  for (const Sample& s : samples_) earliest = std::min(earliest, s.arrival_s - rate_ * s.device_s);
  intercept_s_ = earliest;
  // Late arrivals say nothing of the clock, only the frames that the line rests on do.
  for (const auto& s : best) {
    if (!s) continue;
    const double late = s->arrival_s - predicted_s(s->device_s);
    squares += late * late;
  }
  residual_rms_s_ = std::sqrt(squares / n);
}

double ClockMap::offset_s() const {
  if (samples_.empty()) return 0;
  const double device_s = samples_.back().device_s;
  return static_cast<double>(host_origin_ns_ - device_origin_ns_) * ns + predicted_s(device_s) -
         device_s;
}

std::optional<std::uint64_t> GvspFrameCounter::unwrap(std::uint16_t frame_id) {
  if (frame_id == 0) return std::nullopt;
  if (!last_) {
    last_ = frame_id;
    return next_++;
  }
  // Distance on the circle 1..65535; the far half is the past.
  const int step = steps(*last_, frame_id);
  if (step == 0 || step > 32767) return std::nullopt;
  last_ = frame_id;
  next_ += static_cast<std::uint64_t>(step);
  return next_ - 1;
}

}  // namespace orbitfuse
