// SPDX-License-Identifier: BSD-3-Clause
#include "recon/depth/stereo/patch_match.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

#include "core/numeric/random.hpp"

namespace orbitfuse::depth {
namespace {

/// A small stream per pixel.
class Random {
 public:
  Random(std::uint64_t seed, std::uint64_t key) : state_(seed * split_mix_step ^ key) {}
  float uniform() {  // [0, 1)
    const std::uint64_t bits = split_mix(state_);
    state_ += split_mix_step;
    return uniform01(bits);
  }
  float spread(float width) { return width * (2 * uniform() - 1); }

 private:
  std::uint64_t state_;
};

Eigen::Vector3f ray_of(const DepthView& view, int x, int y) {
  return view.camera.ray_of({x + 0.5, y + 0.5}).cast<float>();
}

constexpr float least_slant = 0.12f;  // cosine between normal and ray: about 83 degrees

/// The normal made to face the camera at no more than a grazing angle.
Eigen::Vector3f facing(Eigen::Vector3f normal, const Eigen::Vector3f& ray) {
  const Eigen::Vector3f toward = -ray.normalized();
  float cosine = normal.normalized().dot(toward);
  normal.normalize();
  if (cosine < 0) {
    normal = -normal;
    cosine = -cosine;
  }
  if (cosine < least_slant) normal = (normal + (2 * least_slant) * toward).normalized();
  return normal;
}

/// Where the plane seen at one ray meets another, z along the axis; NaN if behind.
float depth_on(const Plane& plane, const Eigen::Vector3f& own_ray, const Eigen::Vector3f& ray) {
  const float bottom = plane.normal.dot(ray);
  const float depth = plane.depth * plane.normal.dot(own_ray) / bottom;
  return bottom < 0 && depth > 0 ? depth : std::numeric_limits<float>::quiet_NaN();
}

constexpr std::size_t most_sources = 16;
/// Those that show a pixel's plane, best first.
using Sources = std::array<std::uint8_t, most_sources>;

/// A pixel of a lower cost is sure which sources show it: another plane has to do better in those,
/// before all are asked. A quarter of the work less, as many pixels confirmed (docs/notes/nerf.md).
constexpr float sure_cost = 0.2f;

/// Planes that no later stage tells apart: depths must agree within 1.2 % (DepthOptions).
bool same_plane(const Plane& a, const Plane& b) {
  constexpr float same_depth = 1e-3f, same_cosine = 0.999f;
  return std::abs(a.depth - b.depth) <= same_depth * b.depth &&
         a.normal.dot(b.normal) >= same_cosine;
}

struct Match {
  const DepthView& view;
  const std::vector<SourceView>& sources;
  int best;  ///< sources that count
  float ifx, ify, icx, icy;

  /// Mean of the best sources' costs: a surface is not seen by all. Below the worst, `limit` is
  /// what those that `shown_by` names first must reach before the others are asked: if they don't,
  /// the answer is the worst. `shown_by` becomes the sources in their order.
  float cost(const ReferencePatch& patch, const Plane& plane, const Eigen::Vector3f& ray,
             float limit, Sources& shown_by) const {
    // n . X over the plane is constant: depth * n . ray. In pixels: K^-T n / that.
    const float scale = 1.0f / (plane.depth * plane.normal.dot(ray));
    const Eigen::Vector3f n = plane.normal * scale;
    const Eigen::Vector3f pixels(n.x() * ifx, n.y() * ify, n.z() - n.x() * icx - n.y() * icy);
    const std::size_t count = sources.size(),
                      used = std::min(static_cast<std::size_t>(best), count);
    std::array<float, most_sources> costs;
    Sources order{};
    std::size_t known = 0;
    std::uint32_t asked = 0;
    const auto ask = [&](std::uint8_t source) {
      const float c = patch_cost(patch, sources[source], pixels);
      std::size_t at = known++;  // insertion sort
      for (; at > 0 && costs[at - 1] > c; --at)
        costs[at] = costs[at - 1], order[at] = order[at - 1];
      costs[at] = c, order[at] = source;
      asked |= 1u << source;
      return c;
    };
    float sum = 0;
    for (std::size_t i = 0; limit < worst_cost && i < used; ++i) {
      sum += ask(shown_by[i]);
      if (sum > limit * static_cast<float>(used)) return worst_cost;
    }
    for (std::uint8_t i = 0; i < count; ++i)
      if ((asked >> i & 1u) == 0) ask(i);
    shown_by = order;
    return std::accumulate(costs.begin(), costs.begin() + used, 0.0f) / static_cast<float>(used);
  }
};

Match match_of(const DepthView& view, const std::vector<SourceView>& sources, int best) {
  const Camera& c = view.camera;
  return {view,
          sources,
          best,
          static_cast<float>(1 / c.fx),
          static_cast<float>(1 / c.fy),
          static_cast<float>(c.cx / c.fx),
          static_cast<float>(c.cy / c.fy)};
}

PlaneMap blank_map(const DepthView& view) {
  PlaneMap map;
  map.width = view.gray.cols;
  map.height = view.gray.rows;
  const auto pixels = static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height);
  map.plane.resize(pixels);
  map.cost.assign(pixels, worst_cost);
  return map;
}

}  // namespace

PlaneMap random_planes(const DepthView& view, DepthRange range, const std::vector<Seed>& seeds,
                       std::uint64_t seed) {
  PlaneMap map = blank_map(view);
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x) {
      Random random(seed, map.at(x, y));
      Plane& plane = map.plane[map.at(x, y)];
      const float u = random.uniform();
      plane.depth = 1 / ((1 - u) / range.near + u / range.far);
      const Eigen::Vector3f ray = ray_of(view, x, y);
      plane.normal = facing(
          Eigen::Vector3f(random.spread(1), random.spread(1), random.spread(1)) - ray.normalized(),
          ray);
    }
  // A seed speaks for its surroundings: half of the pixels there start at its depth.
  constexpr int reach = 8;
  for (const Seed& s : seeds) {
    if (!(s.depth >= range.near && s.depth <= range.far)) continue;
    const int sx = static_cast<int>(s.x), sy = static_cast<int>(s.y);
    for (int y = std::max(0, sy - reach); y <= std::min(map.height - 1, sy + reach); ++y)
      for (int x = std::max(0, sx - reach); x <= std::min(map.width - 1, sx + reach); ++x)
        if ((x == sx && y == sy) || Random(seed + 1, map.at(x, y)).uniform() < 0.5f)
          map.plane[map.at(x, y)].depth = s.depth;
  }
  return map;
}

PlaneMap doubled(const PlaneMap& coarse, const DepthView& fine, DepthRange range) {
  PlaneMap map = blank_map(fine);
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x) {
      const int cx = std::min(coarse.width - 1, x * coarse.width / map.width);
      const int cy = std::min(coarse.height - 1, y * coarse.height / map.height);
      const Plane& from = coarse.plane[coarse.at(cx, cy)];
      Plane& to = map.plane[map.at(x, y)];
      to = from;
      // The coarse pixel's ray in the fine camera.
      const Eigen::Vector3f own = fine.camera
                                      .ray_of({(cx + 0.5) * map.width / coarse.width,
                                               (cy + 0.5) * map.height / coarse.height})
                                      .cast<float>();
      const float depth = depth_on(from, own, ray_of(fine, x, y));
      if (std::isfinite(depth)) to.depth = std::clamp(depth, range.near, range.far);
    }
  return map;
}

void improve(PlaneMap& map, const DepthView& view, const std::vector<SourceView>& sources,
             DepthRange range, int iterations, const DepthOptions& options, std::uint64_t seed) {
  if (sources.empty()) return;
  const Match match = match_of(view, sources, options.best_neighbours);
  std::vector<Eigen::Vector3f> rays(map.plane.size());
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x) rays[map.at(x, y)] = ray_of(view, x, y);
  static constexpr int offers[8][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1},
                                       {-5, 0}, {5, 0}, {0, -5}, {0, 5}};
  // All neighbours are of the other colour. A plane that was offered before is no better now: only
  // those that changed since this pixel's last turn are looked at, a third of the work less.
  std::vector<int> changed(map.plane.size(), 0);
  std::vector<Sources> shown_by(map.plane.size());
  for (int iteration = 0; iteration <= iterations; ++iteration) {
    // Round 0 only prices what is there; changes shrink by half each round.
    const float width = std::ldexp(0.5f, -iteration);
    for (int color = 0; color < (iteration == 0 ? 1 : 2); ++color) {
      const int turn = 2 * iteration + color;
      for (int y = 0; y < map.height; ++y)
        for (int x = 0; x < map.width; ++x) {
          if (iteration > 0 && (x + y) % 2 != color) continue;
          const std::size_t here = map.at(x, y);
          const Eigen::Vector3f& ray = rays[here];
          const ReferencePatch patch = reference_patch(view, x, y);
          Plane best = map.plane[here];
          if (iteration == 0) {
            map.cost[here] = match.cost(patch, best, ray, worst_cost, shown_by[here]);
            continue;
          }
          if (is_flat(patch)) continue;  // no plane is better than another
          float best_cost = map.cost[here];
          const auto offer = [&](const Plane& plane) {
            if (!(plane.depth >= range.near && plane.depth <= range.far)) return;
            Sources by = shown_by[here];
            const float limit = best_cost < sure_cost ? best_cost : worst_cost;
            const float cost = match.cost(patch, plane, ray, limit, by);
            if (cost < best_cost) {
              shown_by[here] = by;
              best_cost = cost;
              best = plane;
              changed[here] = turn;
            }
          };
          for (const auto& o : offers) {
            const int nx = x + o[0], ny = y + o[1];
            if (nx < 0 || ny < 0 || nx >= map.width || ny >= map.height) continue;
            const std::size_t there = map.at(nx, ny);
            if (iteration > 1 && changed[there] < turn - 1) continue;
            Plane plane = map.plane[there];
            plane.depth = depth_on(plane, rays[there], ray);
            plane.normal = facing(plane.normal, ray);
            if (!same_plane(plane, best)) offer(plane);
          }
          Random random(seed + static_cast<std::uint64_t>(iteration) * 1000003u, here);
          Plane change = best;
          change.depth = 1 / std::clamp(1 / best.depth * (1 + random.spread(width)), 1 / range.far,
                                        1 / range.near);
          offer(change);
          change = best;
          change.normal =
              facing(best.normal + Eigen::Vector3f(random.spread(width), random.spread(width),
                                                   random.spread(width)),
                     ray);
          offer(change);
          change = best;
          change.depth = best.depth * (1 + random.spread(0.1f * width));
          change.normal =
              facing(best.normal + Eigen::Vector3f(random.spread(width), random.spread(width),
                                                   random.spread(width)),
                     ray);
          offer(change);
          map.plane[here] = best;
          map.cost[here] = best_cost;
        }
    }
  }
}

}  // namespace orbitfuse::depth
