// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

namespace orbitfuse::fusion {

/// Time steps of one cycle of fast explicit diffusion (Grewenig, Weickert, Bruhn 2010, "From box
/// filtering to fast explicit diffusion", section 3): n steps, some far beyond `stable_step`, that
/// together reach `time` = stable_step (n^2 + n) / 3 and are stable for an operator that does not
/// change meanwhile. n is the least that reaches `time`; the steps are scaled to reach it exactly
/// and ordered (Gentzsch and Schlueter 1978) so that rounding stays small in between.
std::vector<double> fast_explicit_steps(double time, double stable_step);

/// Longest `time` of a cycle whose steps, ordered so, may be taken in single precision (20 steps).
double longest_cycle(double stable_step);

}  // namespace orbitfuse::fusion
