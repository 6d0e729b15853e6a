// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "recon/nerf/kernels/kernels.hpp"

namespace orbitfuse::nerf {

/// The trainable numbers of a hash grid's levels. Seen from outside a list of numbers as Parameters
/// is; in memory what belongs to a number lies together (GridLine).
class GridTable {
 public:
  using Part = float (GridLine::*)[4];

  /// All zero. `levels` lie one behind the other and have whole lines each.
  void resize(const std::vector<GridLevel>& levels);
  std::size_t size() const { return 4 * lines_.size(); }
  float& value(std::size_t i) { return lines_[i / 4].value[i % 4]; }
  float value(std::size_t i) const { return lines_[i / 4].value[i % 4]; }

  std::vector<float> part(Part part) const;
  void set_part(Part part, const std::vector<float>& numbers);  ///< size() of them
  std::vector<float> values() const { return part(&GridLine::value); }
  void set_values(const std::vector<float>& values) { set_part(&GridLine::value, values); }

  /// One level's lines, and which of them have a gradient: a bit each, in words of its own, so that
  /// levels may be worked on at the same time.
  struct Level {
    GridLine* lines;
    std::uint64_t* touched;
    std::int64_t words;
  };
  Level level(const std::vector<GridLevel>& levels, std::size_t index);

 private:
  std::vector<GridLine> lines_;
  std::vector<std::vector<std::uint64_t>> touched_;
};

}  // namespace orbitfuse::nerf
