// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>

#include "core/session.hpp"

namespace orbitfuse {

/// How one camera has seen a turntable. Cameras may see it one after the other, and each then makes
/// its own turns.
struct TableView {
  int photos = 0;                   ///< counted by this camera
  bool counts_photos = false;       ///< its photos began before the first key
  std::optional<double> start_deg;  ///< azimuth at which its first turn began
  double turned_deg = 0;            ///< since then, never negative
};

/// The angle of a turntable from what its operator does: one count for all cameras. Azimuths are
/// 0..360 degrees.
class Turntable {
 public:
  /// `step_deg`: the azimuth's change per step, negative for a table that turns the other way.
  explicit Turntable(double step_deg) : step_deg_(step_deg) {}

  /// The operator's key: the table was turned by a step (the first key: it stands at its start).
  double key() { return azimuth_deg(++keys_); }
  /// A camera's photo: where the last key put the table, so that a photo can be taken again. A
  /// camera whose photos began without keys: a step each, however late the photos arrive.
  double photo(TableView& view) const;
  /// `view` saw the table at `station`; the next key or photo is a step further.
  void resume_at(TableView& view, const Station& station);

  /// False until the first key, or a station to go on from.
  bool begun() const { return keys_ > 0 || steps_before_ == 0; }
  /// Which full turn this is for `view`, now that it sees the table at `azimuth_deg`.
  std::size_t turn(TableView& view, double azimuth_deg) const;
  std::size_t turn_after_step(const TableView& view) const;

 private:
  double azimuth_deg(int count) const;
  double way_deg(double from_deg, double to_deg) const;

  double step_deg_;
  double base_deg_ = 0;
  int steps_before_ = -1;  ///< of the first count: it is at the base, or a step after it
  int keys_ = 0;
};

}  // namespace orbitfuse
