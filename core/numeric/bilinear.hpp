// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <optional>
#include <type_traits>

// Values between samples on a grid. Places count from the first sample's centre in steps of the
// grid: an image's pixel coordinates less 0.5. A value is not a number where one of the four
// samples is not, even one that weighs nothing.
namespace orbitfuse {

/// The four samples round a place, and how far on it lies from the first of them, 0..1 a step.
template <class Weight>
struct BilinearPlace {
  int x0, y0, x1, y1;
  Weight right, down;
};

/// None outside of the samples' centres, on the last of a row or column, and where it is NaN.
template <class Weight, class Coordinate>
std::optional<BilinearPlace<Weight>> place_among(int columns, int rows, Coordinate x,
                                                 Coordinate y) {
  const auto last_x = static_cast<Coordinate>(columns - 1),
             last_y = static_cast<Coordinate>(rows - 1);
  if (!(x >= 0 && y >= 0 && x < last_x && y < last_y)) return std::nullopt;
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  return BilinearPlace<Weight>{x0,
                               y0,
                               x0 + 1,
                               y0 + 1,
                               static_cast<Weight>(x - static_cast<Coordinate>(x0)),
                               static_cast<Weight>(y - static_cast<Coordinate>(y0))};
}

/// Outside, the outermost samples hold. Neither coordinate may be NaN.
template <class Weight>
BilinearPlace<Weight> place_held(int columns, int rows, double x, double y) {
  x = std::clamp(x, 0.0, columns - 1.0);
  y = std::clamp(y, 0.0, rows - 1.0);
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  return {x0,
          y0,
          std::min(x0 + 1, columns - 1),
          std::min(y0 + 1, rows - 1),
          static_cast<Weight>(x - x0),
          static_cast<Weight>(y - y0)};
}

/// The value there; `at(row, column)` gives a sample, which sums and takes a weight as a factor.
template <class Weight, class At>
auto blended(const BilinearPlace<Weight>& place, const At& at) {
  using Value = std::decay_t<decltype(at(0, 0))>;
  const auto& [x0, y0, x1, y1, right, down] = place;
  Value value = (1 - down) * ((1 - right) * at(y0, x0) + right * at(y0, x1)) +
                down * ((1 - right) * at(y1, x0) + right * at(y1, x1));
  return value;
}

}  // namespace orbitfuse
