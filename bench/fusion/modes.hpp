// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "bench/fusion/pairs.hpp"

// What bench_fusion can measure; each prints Markdown to standard output and returns an exit
// status.
namespace orbitfuse::bench {

/// The methods at their defaults beside the references, and with `knobs` every knob. `out`, if not
/// empty: fusion.json (all rows) and curves/fusion_knobs.svg (Qabf and Qcb against CPU time) there.
int sweep(const std::filesystem::path& folder, bool knobs, const std::filesystem::path& out);

/// Wall and CPU milliseconds of every method and of the metrics, for the instruction set in use
/// and, in a process of its own, for AVX2.
int speed(const std::filesystem::path& folder, const char* program);

/// Every method with skipping off and on: what was skipped, and the difference in Qabf, each pair.
int skipping(const std::filesystem::path& folder);

/// `best` with its constants chosen on half of the pairs, scored on the others, and the reverse.
int cross_check(const std::filesystem::path& folder);

/// What keeps `best` from halos (fusion/best/halo_rule.hpp): its constants chosen by
/// cross-validation, and the halo of scenes made by code.
int halos(const std::filesystem::path& folder);

}  // namespace orbitfuse::bench
