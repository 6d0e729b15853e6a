// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/session/session.hpp"

namespace orbitfuse {

/// How one camera has seen a turntable. Cameras may see it one after the other, and each then makes
/// its own turns.
struct TableView {
  int photos = 0;                   ///< counted by this camera
  bool counts_photos = false;       ///< its photos began before the first key
  std::optional<double> start_deg;  ///< azimuth at which its first turn began
  double turned_deg = 0;            ///< since then, never negative
  std::optional<int> key;           ///< at which turned_deg held
};

/// The angle of a turntable from what its operator does: one count for all cameras. Azimuths are
/// 0..360 degrees.
class Turntable {
 public:
  /// `step_deg`: the azimuth's change per step, negative for a table that turns the other way.
  explicit Turntable(double step_deg) : step_deg_(step_deg) {}
  double step_deg() const { return step_deg_; }

  /// The operator's key: the table was turned by a step (the first key: it stands at its start).
  /// Returns its number, from 1.
  int key(std::int64_t time_ns);
  /// A photo of a camera whose photos began without keys: a step each, however late they arrive.
  double photo(TableView& view) const { return azimuth_deg(++view.photos); }
  /// The key before a photo that was taken at `photo_ns`, however late it arrives; nullopt when
  /// that is before the first key, or too coarse to tell (whole seconds, as EXIF has).
  std::optional<int> key_before(std::int64_t photo_ns) const;
  double azimuth_deg(int count) const;
  /// `view` saw the table at `station`; the next key or photo is a step further.
  void resume_at(TableView& view, const Station& station);

  /// False until the first key, or a station to go on from.
  bool begun() const { return keys() > 0 || steps_before_ == 0; }
  int keys() const { return static_cast<int>(key_times_ns_.size()); }
  /// Which full turn this is for `view`, now that it sees the table at `azimuth_deg`.
  std::size_t turn(TableView& view, double azimuth_deg) const;
  /// The same at a key, also one before the latest that `view` knows.
  std::size_t turn_at_key(TableView& view, int key) const;
  std::size_t turn_after_step(const TableView& view) const;

 private:
  double way_deg(double from_deg, double to_deg) const;

  double step_deg_;
  double base_deg_ = 0;
  int steps_before_ = -1;  ///< of the first count: it is at the base, or a step after it
  std::vector<std::int64_t> key_times_ns_;  ///< rising
};

}  // namespace orbitfuse
