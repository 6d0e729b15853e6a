// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/known/blocks.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "recon/poses/index.hpp"
#include "recon/poses/sfm/joined_sets.hpp"

namespace orbitfuse {
namespace {

/// Of fewer all pairs are matched, also those that show sides which look alike.
constexpr int least_frames = 9;
/// A pair that holds so much hangs together.
constexpr std::size_t least_of_pair = 30;
constexpr double fits_px = 4, fits_share = 0.7;
/// Blocks are apart if the pairs between them hold less.
constexpr std::size_t least_of_block = 3, least_across = 60;
constexpr double apart_px = 8, apart_share = 0.5;

/// Of `sets` those that another one's poses contradict; matches between sets that hold tell
/// nothing.
std::optional<Blocks> apart(std::vector<std::vector<int>> sets,
                            const std::vector<PairMisses>& misses, int frames, double px) {
  std::vector<int> set_of(at(frames), -1);
  for (std::size_t s = 0; s < sets.size(); ++s)
    for (const int f : sets[s]) set_of[at(f)] = static_cast<int>(s);
  std::map<ViewPair, Held> between;
  for (const PairMisses& of_pair : misses) {
    const int a = set_of[at(of_pair.pair.first)], b = set_of[at(of_pair.pair.second)];
    if (a < 0 || b < 0 || a == b || of_pair.px.size() < least_of_pair) continue;
    const Held held = held_of(of_pair, px);
    Held& sum = between[std::minmax(a, b)];
    sum.held += held.held, sum.all += held.all;
  }
  Blocks blocks;
  std::set<int> contradicted;
  for (const auto& [pair, held] : between) {
    if (held.all < least_across || held.share() >= apart_share) continue;
    contradicted.insert({pair.first, pair.second});
    blocks.across.held += held.held, blocks.across.all += held.all;
  }
  for (const int s : contradicted) blocks.frames.push_back(std::move(sets[at(s)]));
  return blocks.frames.empty() ? std::nullopt : std::optional(std::move(blocks));
}

}  // namespace

std::optional<Blocks> separate_blocks(const std::vector<PairMisses>& misses, int frames,
                                      double all_off) {
  if (frames < least_frames) return std::nullopt;
  JoinedSets tied(frames);
  for (const PairMisses& of_pair : misses) {
    const Held held = held_of(of_pair, fits_px * all_off);
    if (held.all >= least_of_pair && held.share() >= fits_share)
      tied.join(of_pair.pair.first, of_pair.pair.second);
  }
  std::vector<std::vector<int>> sets(at(frames));
  for (int f = 0; f < frames; ++f) sets[at(tied.root(f))].push_back(f);
  sets.erase(std::remove_if(sets.begin(), sets.end(),
                            [](const auto& set) { return set.size() < least_of_block; }),
             sets.end());
  return apart(std::move(sets), misses, frames, apart_px * all_off);
}

}  // namespace orbitfuse
