// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/clouds/match_consensus.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>

namespace orbitfuse::registration {
namespace {

constexpr double scale_slack = 1.22;   // either way: the descriptor radii stand 1.25 apart
constexpr double normal_slack = 0.30;  // of cosines
constexpr double shortest = 0.25;      // segments below say little about scale or direction
constexpr double clique_scale_slack = 1.10;
constexpr int fewest_common = 2;  // with the edge's ends four points: one more than any fit needs

/// A square table of bits.
class BitRows {
 public:
  explicit BitRows(int n)
      : n_(n), words_((n + 63) / 64), bits_(static_cast<std::size_t>(n * words_), 0) {}
  void set(int row, int column) { word(row, column / 64) |= std::uint64_t{1} << (column % 64); }
  bool get(int row, int column) const { return word(row, column / 64) >> (column % 64) & 1; }
  int common(int a, int b) const {
    int count = 0;
    for (int w = 0; w < words_; ++w) count += std::popcount(word(a, w) & word(b, w));
    return count;
  }
  std::vector<int> common_list(int a, int b) const {
    std::vector<int> list;
    for (int i = 0; i < n_; ++i) {
      if (get(a, i) && get(b, i)) list.push_back(i);
    }
    return list;
  }

 private:
  std::uint64_t& word(int row, int w) { return bits_[static_cast<std::size_t>(row * words_ + w)]; }
  std::uint64_t word(int row, int w) const {
    return bits_[static_cast<std::size_t>(row * words_ + w)];
  }
  int n_, words_;
  std::vector<std::uint64_t> bits_;
};

struct Ends {
  Eigen::Vector3d source, target, source_normal, target_normal;
};

/// The scale between two segments when they agree.
std::optional<double> agreed_scale(const Ends& a, const Ends& b, double scale) {
  const Eigen::Vector3d u = b.source - a.source, v = b.target - a.target;
  const double lu = u.norm(), lv = v.norm();
  if (lu < shortest || lv < shortest) return std::nullopt;
  const double ratio = lv / lu;
  if (ratio > scale * scale_slack || ratio * scale_slack < scale) return std::nullopt;
  const auto differ = [](double x, double y) { return std::abs(x - y) > normal_slack; };
  if (differ(a.source_normal.dot(u) / lu, a.target_normal.dot(v) / lv)) return std::nullopt;
  if (differ(b.source_normal.dot(u) / lu, b.target_normal.dot(v) / lv)) return std::nullopt;
  if (differ(a.source_normal.dot(b.source_normal), a.target_normal.dot(b.target_normal)))
    return std::nullopt;
  return ratio;
}

}  // namespace

Candidates consensus_candidates(const FeaturePoints& source, const FeaturePoints& target,
                                const std::vector<Match>& matches, double scale, int most) {
  const auto n = static_cast<int>(matches.size());
  std::vector<Ends> ends;
  for (const Match& m : matches) {
    const auto s = static_cast<std::size_t>(m.source), t = static_cast<std::size_t>(m.target);
    ends.push_back({source.points[s], target.points[t], source.normals[s], target.normals[t]});
  }
  const auto at = [&](int i) -> const Ends& { return ends[static_cast<std::size_t>(i)]; };
  BitRows friends(n);
  for (int i = 0; i < n; ++i) {
    for (int j = i + 1; j < n; ++j) {
      if (agreed_scale(at(i), at(j), scale)) {
        friends.set(i, j);
        friends.set(j, i);
      }
    }
  }
  // Each match's best edge, by common friends.
  struct Edge {
    int common, a, b;
  };
  std::vector<Edge> edges;
  for (int i = 0; i < n; ++i) {
    std::optional<Edge> best;
    for (int j = 0; j < n; ++j) {
      if (!friends.get(i, j)) continue;
      const int common = friends.common(i, j);
      if (!best || common > best->common) best = {common, i, j};
    }
    if (best && best->common >= fewest_common) edges.push_back(*best);
  }
  std::stable_sort(edges.begin(), edges.end(),
                   [](const Edge& x, const Edge& y) { return x.common > y.common; });
  Candidates candidates;
  BitRows used(n);
  for (const Edge& edge : edges) {
    if (static_cast<int>(candidates.size()) >= most) break;
    if (used.get(edge.a, edge.b)) continue;
    used.set(edge.a, edge.b);
    used.set(edge.b, edge.a);
    const auto edge_scale = agreed_scale(at(edge.a), at(edge.b), scale);
    if (!edge_scale) continue;
    Points p{at(edge.a).source, at(edge.b).source}, q{at(edge.a).target, at(edge.b).target};
    for (const int i : friends.common_list(edge.a, edge.b)) {
      const auto of_a = agreed_scale(at(edge.a), at(i), scale),
                 of_b = agreed_scale(at(edge.b), at(i), scale);
      if (!of_a || !of_b) continue;  // friends but for the last bit
      const double ra = *of_a / *edge_scale, rb = *of_b / *edge_scale;
      if (std::max({ra, rb, 1 / ra, 1 / rb}) > clique_scale_slack * clique_scale_slack) continue;
      p.push_back(at(i).source);
      q.push_back(at(i).target);
    }
    if (p.size() < 4) continue;
    const Result<RobustSimilarity> fit = robust_umeyama(p, q, 0.12);
    if (!fit) continue;
    candidates.push_back({.target_from_source = fit->target_from_source, .origin = "features"});
  }
  return candidates;
}

}  // namespace orbitfuse::registration
