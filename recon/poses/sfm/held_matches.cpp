// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/held_matches.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <queue>

#include "recon/poses/index.hpp"

namespace orbitfuse {
namespace {

constexpr std::size_t plenty = 30;  // two-view geometry holds half as many by chance
/// Of the matches that join two frames, what a pair's that contradicts them must be for it to
/// count. The marks of a ring round a flower pot, taken for one another, are 0.07 of them at most,
/// over right poses; of 138 such pairs of wrong models 131 are more than 0.1, half of them 0.22.
constexpr double outweighs = 0.1;

/// Per frame: its partners, and how many matches with each the poses hold.
using Bonds = std::vector<std::map<int, int>>;

/// The path of fewest frames along bonds that are left, as the frame before each; -1: not reached.
std::vector<int> shortest_path(const Bonds& left, int from, int to) {
  std::vector<int> before(left.size(), -1);
  before[at(from)] = from;
  std::queue<int> open({from});
  while (!open.empty() && before[at(to)] < 0) {
    const int f = open.front();
    open.pop();
    for (const auto& [g, matches] : left[at(f)])
      if (matches > 0 && before[at(g)] < 0) before[at(g)] = f, open.push(g);
  }
  return before;
}

/// The fewest held matches that would all have to be false if two frames lay otherwise to each
/// other, which is the most that flow from one to the other (Ford and Fulkerson, Maximal flow
/// through a network, 1956); counted up to `enough`.
int matches_joining(Bonds left, int from, int to, int enough) {
  int joined = 0;
  while (joined < enough) {
    const std::vector<int> before = shortest_path(left, from, to);
    if (before[at(to)] < 0) break;
    int narrowest = std::numeric_limits<int>::max();
    for (int f = to; f != from; f = before[at(f)])
      narrowest = std::min(narrowest, left[at(before[at(f)])].at(f));
    for (int f = to; f != from; f = before[at(f)]) {
      left[at(before[at(f)])].at(f) -= narrowest;
      left[at(f)].at(before[at(f)]) += narrowest;
    }
    joined += narrowest;
  }
  return joined;
}

bool contradicts(const PairVote& vote) {
  return vote.matches >= plenty && 4 * vote.held < vote.matches;
}

}  // namespace

std::vector<PairVote> votes_of(const FeatureGraph& graph, const PosedFrames& posed) {
  std::vector<PairVote> votes;
  for (const auto& [pair, matches] : graph.verified) {
    if (!posed.poses[at(pair.first)] || !posed.poses[at(pair.second)]) continue;
    const EpipolarBand band =
        epipolar_band(graph, pair, posed, TrackOptions{}.max_error_px * graph.pixel_scale);
    PairVote vote{pair, matches.size(), 0};
    for (const auto& [i, j] : matches) vote.held += band.distance(i, j) <= band.half_width;
    votes.push_back(vote);
  }
  return votes;
}

HeldMatches held_matches(const FeatureGraph& graph, const PosedFrames& posed,
                         const PairQuestion& mistaken) {
  HeldMatches result;
  const std::vector<PairVote> votes = votes_of(graph, posed);
  Bonds bonds(at(graph.count()));
  std::size_t all = 0, held = 0, in_contradicted = 0;
  for (const PairVote& vote : votes) {
    const auto& [a, b] = vote.pair;
    bonds[at(a)][b] = bonds[at(b)][a] = static_cast<int>(vote.held);
    all += vote.matches;
    held += vote.held;
  }
  if (all == 0) return result;
  for (const PairVote& vote : votes) {
    if (!contradicts(vote)) continue;
    const auto against = static_cast<double>(vote.matches - vote.held);
    const int enough = static_cast<int>(against / outweighs) + 1;
    if (matches_joining(bonds, vote.pair.first, vote.pair.second, enough) >= enough) {
      ++result.outvoted;
      continue;
    }
    if (mistaken && mistaken(vote)) {
      ++result.mistaken;
      continue;
    }
    ++result.contradicted;
    in_contradicted += vote.matches;
  }
  result.share = static_cast<double>(held) / static_cast<double>(all);
  result.contradicted_share = static_cast<double>(in_contradicted) / static_cast<double>(all);
  return result;
}

}  // namespace orbitfuse
