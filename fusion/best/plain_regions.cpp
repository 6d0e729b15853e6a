// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/best/plain_regions.hpp"

#include <cmath>

namespace orbitfuse::fusion {

Plane within_regions(const Plane& value, const Plane& own, const Plane& visible,
                     const Plane& thermal, const Ties& ties) {
  constexpr float least = 1e-3F;      // across any edge: nothing stands alone
  constexpr float relaxation = 1.8F;  // of 2 at most; a value crosses a region in fewer sweeps
  const int rows = value.rows, columns = value.cols;
  const auto tie = [&](int y, int x, int v, int u) {
    const float step =
        std::abs(visible(y, x) - visible(v, u)) + std::abs(thermal(y, x) - thermal(v, u));
    const float edges = step / ties.edge;
    return ties.strength * std::exp(-edges * edges) + least;
  };
  Plane right(value.size(), 0), below(value.size(), 0);
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      if (x + 1 < columns) right(y, x) = tie(y, x, y, x + 1);
      if (y + 1 < rows) below(y, x) = tie(y, x, y + 1, x);
    }
  Plane result = value.clone();
  for (int sweep = 0; sweep < ties.sweeps; ++sweep)
    for (int y = 0; y < rows; ++y)
      for (int x = 0; x < columns; ++x) {
        float sum = own(y, x) * value(y, x), all = own(y, x);
        const auto add = [&](float strength, float neighbour) {
          sum += strength * neighbour;
          all += strength;
        };
        if (x > 0) add(right(y, x - 1), result(y, x - 1));
        if (y > 0) add(below(y - 1, x), result(y - 1, x));
        if (x + 1 < columns) add(right(y, x), result(y, x + 1));
        if (y + 1 < rows) add(below(y, x), result(y + 1, x));
        result(y, x) += relaxation * (sum / all - result(y, x));
      }
  return result;
}

}  // namespace orbitfuse::fusion
