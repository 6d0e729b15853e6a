// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/pixel_tiles.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/system/parallel.hpp"

namespace orbitfuse::nerf {
namespace {

/// Times the mean: an outline isn't worth more than four textures.
constexpr double most_texture = 4;
constexpr double even_weight = 1000;  ///< a pixel's where the draw is even

/// Standard deviation of the channels' mean; NaN without a value.
double deviation(const cv::Mat& target, const PixelTile& tile) {
  double sum = 0, squares = 0;
  int count = 0;
  const int channels = target.channels();
  for (int y = tile.y; y < tile.y + tile.rows; ++y)
    for (int x = tile.x; x < tile.x + tile.columns; ++x) {
      const float* values = target.ptr<float>(y) + x * channels;
      double value = 0;
      for (int c = 0; c < channels; ++c) value += values[c];
      value /= channels;
      if (!std::isfinite(value)) continue;
      sum += value, squares += value * value;
      ++count;
    }
  if (count == 0) return std::numeric_limits<double>::quiet_NaN();
  const double mean = sum / count;
  return std::sqrt(std::max(0.0, squares / count - mean * mean));
}

std::vector<PixelTile> tiles_of(const std::vector<NormalisedView>& views,
                                const std::vector<bool>& heldout) {
  std::vector<PixelTile> tiles;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const cv::Mat& target = views[i].target;
    for (int y = 0; y < target.rows && !heldout[i]; y += tile_px)
      for (int x = 0; x < target.cols; x += tile_px)
        tiles.push_back({static_cast<int>(i), x, y, std::min(tile_px, target.cols - x),
                         std::min(tile_px, target.rows - y), 1});
  }
  return tiles;
}

}  // namespace

PixelTiles PixelTiles::of(const std::vector<NormalisedView>& views,
                          const std::vector<bool>& heldout, double texture_share) {
  const std::vector<PixelTile> all = tiles_of(views, heldout);
  std::vector<double> texture(all.size());
  parallel_blocks(static_cast<int>(all.size()), 4096, [&](int begin, int end) {
    for (auto t = static_cast<std::size_t>(begin); t < static_cast<std::size_t>(end); ++t)
      texture[t] = deviation(views[static_cast<std::size_t>(all[t].view)].target, all[t]);
  });
  double sum = 0, count = 0;
  for (const double value : texture)
    if (std::isfinite(value)) sum += value, ++count;
  PixelTiles found;
  std::uint64_t end = 0;
  for (std::size_t t = 0; t < all.size(); ++t) {
    if (!std::isfinite(texture[t]) && count > 0) continue;
    const double relative = sum > 0 ? std::min(most_texture, texture[t] * count / sum) : 1;
    PixelTile tile = all[t];
    tile.weight = static_cast<std::uint32_t>(
        std::max(1.0, std::round(even_weight * (1 - texture_share + texture_share * relative))));
    end += static_cast<std::uint64_t>(tile.weight) *
           static_cast<std::uint64_t>(tile.columns * tile.rows);
    found.tiles.push_back(tile);
    found.ends.push_back(end);
  }
  return found;
}

}  // namespace orbitfuse::nerf
