// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/system/clock.hpp"
#include "fusion/fuse/fuse.hpp"

namespace orbitfuse::bench {

struct Pair {
  std::string name;
  cv::Mat visible, thermal;
};

/// <folder>/pairs/NAME_vis.png and NAME_ir.png as gray, by name. Ends the program when there is
/// none.
std::vector<Pair> load_pairs(const std::filesystem::path& folder);
/// The first pair at 640x480, for times.
Pair timed_pair(const std::vector<Pair>& pairs);

using Scores = std::map<std::string, double>;
inline constexpr const char* shown[] = {"Qabf", "Qcb", "Qcv", "SSIM", "halo"};

/// Methods that fuse gray planes and are scored; not heat, which colours one source by the other.
std::vector<std::string> scored_methods();

/// Of <folder>/reference/metrics.csv: method -> scores of each pair, in the order of `pairs`.
std::map<std::string, std::vector<Scores>> reference_scores(const std::filesystem::path& folder,
                                                            const std::vector<Pair>& pairs);
/// Of the method that `options` names, each pair's. Ends the program on an error.
std::vector<Scores> scores(const std::vector<Pair>& pairs, const FusionOptions& options,
                           std::vector<FusionReport>* reports = nullptr);
Scores mean(const std::vector<Scores>& scores);

/// Least of several runs. CPU time holds on a machine with other work, wall time only on an idle
/// one.
struct Times {
  double wall_ms = 1e9, cpu_ms = 1e9;
};
template <class Work>
Times times_of(int runs, const Work& work) {
  Times best;
  for (int i = 0; i < runs; ++i) {
    const UsageClock clock;
    work();
    best.cpu_ms = std::min(best.cpu_ms, 1e3 * clock.cpu_s());
    best.wall_ms = std::min(best.wall_ms, 1e3 * clock.wall_s());
  }
  return best;
}

}  // namespace orbitfuse::bench
