// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/edge_lines.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

#include "tests/support/orbit_fixture.hpp"

namespace orbitfuse {
namespace {

using testing_orbit::two_loops;
using Ends = std::pair<Eigen::Vector3d, Eigen::Vector3d>;

/// The edges of boxes of several sizes about the origin.
std::vector<Ends> box_edges() {
  std::vector<Ends> edges;
  for (const double size : {0.3, 0.55, 0.8})
    for (int axis = 0; axis < 3; ++axis)
      for (const double u : {-size, size})
        for (const double v : {-size, size}) {
          Eigen::Vector3d a, b;
          a[axis] = -size, b[axis] = size;
          a[(axis + 1) % 3] = b[(axis + 1) % 3] = u;
          a[(axis + 2) % 3] = b[(axis + 2) % 3] = 0.7 * v;
          edges.emplace_back(a, b);
        }
  return edges;
}

/// What each view shows of the edges, nothing hidden, among as many segments of nothing.
std::vector<std::vector<ImageSegment>> seen(const std::vector<PosedView>& views,
                                            const std::vector<Ends>& edges, int clutter) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> place(-0.3, 0.3), part(-0.03, 0.03);
  std::vector<std::vector<ImageSegment>> segments(views.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    const auto end = [&](const Eigen::Vector3d& p) -> Eigen::Vector2d {
      return (views[v].cam_from_world * p).hnormalized();
    };
    for (const auto& [a, b] : edges) {
      const Eigen::Vector2d pa = end(a), pb = end(b);
      segments[v].push_back({pa, pb, (pb - pa).norm() * views[v].camera.fx});
    }
    for (int i = 0; i < clutter; ++i) {
      const Eigen::Vector2d a(place(rng), place(rng)),
          b = a + Eigen::Vector2d(part(rng), part(rng));
      segments[v].push_back({a, b, (b - a).norm() * views[v].camera.fx});
    }
  }
  return segments;
}

double off_line(const EdgeLine& line, const Ends& edge) {
  const Eigen::Vector3d along = (edge.second - edge.first).normalized();
  const auto off = [&](const Eigen::Vector3d& p) { return (p - edge.first).cross(along).norm(); };
  return std::max(off(line.a), off(line.b));
}

TEST(EdgeLines, EveryEdgeIsFoundAmongClutter) {
  const auto views = two_loops();
  const auto edges = box_edges();
  const auto lines = triangulate_lines(views, seen(views, edges, 45), {});
  for (const Ends& edge : edges) {
    const auto found = std::find_if(lines.begin(), lines.end(), [&](const EdgeLine& line) {
      return line.views.size() >= 6 && off_line(line, edge) < 0.003;
    });
    EXPECT_NE(found, lines.end()) << edge.first.transpose() << " to " << edge.second.transpose();
  }
}

TEST(EdgeLines, MostConfirmedFirstAndNoneByFewerThanAsked) {
  const auto views = two_loops();
  const auto lines = triangulate_lines(views, seen(views, box_edges(), 45), {});
  ASSERT_FALSE(lines.empty());
  for (std::size_t i = 0; i < lines.size(); ++i) {
    EXPECT_GE(lines[i].views.size(), 3u);
    EXPECT_TRUE(std::is_sorted(lines[i].views.begin(), lines[i].views.end()));
  }
  // By views first: a pair of neighbours that is the wrong way round would show it.
  EXPECT_TRUE(std::is_sorted(lines.begin(), lines.end(), [](const auto& x, const auto& y) {
    return x.views.size() > y.views.size();
  }));
}

TEST(EdgeLines, NothingComesOfNothing) {
  const auto views = two_loops();
  EXPECT_TRUE(triangulate_lines({}, {}, {}).empty());
  EXPECT_TRUE(triangulate_lines(views, std::vector<std::vector<ImageSegment>>(24), {}).empty());
  const auto one = seen({views.front()}, box_edges(), 0);
  EXPECT_TRUE(triangulate_lines({views.front()}, one, {}).empty());
  // Two views of everything: they meet in some line whatever they show.
  std::vector<std::vector<ImageSegment>> two(24);
  const auto all = seen(views, box_edges(), 0);
  two[0] = all[0], two[1] = all[1];
  EXPECT_TRUE(triangulate_lines(views, two, {}).empty());
}

TEST(EdgeLines, PointsAndWhatIsNoNumberMakeNoLines) {
  const auto views = two_loops();
  const auto edges = box_edges();
  auto segments = seen(views, edges, 0);
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), huge = 1e300;
  for (auto& of_view : segments) {
    of_view.push_back({{0.1, 0.1}, {0.1, 0.1}, 0});
    of_view.push_back({{nan, 0.1}, {0.1, nan}, 20});
    of_view.push_back({{huge, -huge}, {-huge, huge}, 20});
  }
  const auto lines = triangulate_lines(views, segments, {});
  const auto clean = triangulate_lines(views, seen(views, edges, 0), {});
  ASSERT_EQ(lines.size(), clean.size());
  for (std::size_t i = 0; i < lines.size(); ++i) {
    EXPECT_TRUE(lines[i].a.allFinite() && lines[i].b.allFinite());
    EXPECT_EQ(lines[i].views, clean[i].views);
  }
}

}  // namespace
}  // namespace orbitfuse
