// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/field/grid_table.hpp"

#include <algorithm>
#include <cassert>

#include "core/system/memory.hpp"

namespace orbitfuse::nerf {

void GridTable::resize(const std::vector<GridLevel>& levels) {
  std::size_t count = 0;
  touched_.clear();
  for (const GridLevel& level : levels) {
    const std::size_t lines = std::size_t{level.entries} * static_cast<std::size_t>(level.features);
    assert(lines % 4 == 0 && level.offset == static_cast<std::int64_t>(4 * count));
    touched_.emplace_back((lines / 4 + 63) / 64);
    count += lines / 4;
  }
  reserve_huge(lines_, count);
  lines_.assign(count, {});
}

std::vector<float> GridTable::part(Part part) const {
  std::vector<float> numbers(size());
  for (std::size_t i = 0; i < lines_.size(); ++i) std::copy_n(lines_[i].*part, 4, &numbers[4 * i]);
  return numbers;
}

void GridTable::set_part(Part part, const std::vector<float>& numbers) {
  assert(numbers.size() == size());
  for (std::size_t i = 0; i < lines_.size(); ++i) std::copy_n(&numbers[4 * i], 4, lines_[i].*part);
}

GridTable::Level GridTable::level(const std::vector<GridLevel>& levels, std::size_t index) {
  return {lines_.data() + levels[index].offset / 4, touched_[index].data(),
          static_cast<std::int64_t>(touched_[index].size())};
}

}  // namespace orbitfuse::nerf
