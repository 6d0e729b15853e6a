// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/known/blocks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "recon/poses/index.hpp"

namespace orbitfuse {
namespace {

/// A pair that holds so much hangs together.
constexpr std::size_t least_of_pair = 30;
constexpr double fits_px = 4, fits_share = 0.7;
/// Blocks are apart if the pairs between them hold less.
constexpr std::size_t least_of_block = 3, least_across = 60;
constexpr double apart_px = 8, apart_share = 0.5;

Held held_in(const PairMisses& misses, double px) { return held_within({misses}, px); }

}  // namespace

std::optional<Blocks> separate_blocks(const std::vector<PairMisses>& misses, int frames,
                                      double all_off) {
  std::vector<int> root(at(frames));
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int f) {
    while (root[at(f)] != f) f = root[at(f)];
    return f;
  };
  for (const PairMisses& of_pair : misses) {
    const Held held = held_in(of_pair, fits_px * all_off);
    if (held.all < least_of_pair || held.share() < fits_share) continue;
    const int a = find(of_pair.pair.first), b = find(of_pair.pair.second);
    root[at(std::max(a, b))] = std::min(a, b);
  }
  std::vector<std::vector<int>> sets(at(frames));
  for (int f = 0; f < frames; ++f) sets[at(find(f))].push_back(f);
  Blocks blocks;
  for (std::vector<int>& set : sets)
    if (set.size() >= least_of_block) blocks.frames.push_back(std::move(set));
  if (blocks.frames.size() < 2) return std::nullopt;
  std::vector<int> block_of(at(frames), -1);
  for (std::size_t b = 0; b < blocks.frames.size(); ++b)
    for (const int f : blocks.frames[b]) block_of[at(f)] = static_cast<int>(b);
  for (const PairMisses& of_pair : misses) {
    const int a = block_of[at(of_pair.pair.first)], b = block_of[at(of_pair.pair.second)];
    if (a < 0 || b < 0 || a == b) continue;
    const Held held = held_in(of_pair, apart_px * all_off);
    blocks.across.held += held.held, blocks.across.all += held.all;
  }
  if (blocks.across.all < least_across || blocks.across.share() >= apart_share) return std::nullopt;
  return blocks;
}

}  // namespace orbitfuse
