// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace orbitfuse::planning {

/// Seconds this machine needs, as it is loaded now, for what takes one second where stage_s() was
/// measured: from half a second of training a field of noise, which is what a run does most.
/// 1 if that can't be told.
double measured_slowness();

/// Of a whole stage, from that of a training step, both 1 for the reference: they go together, but
/// for what a processor's tiles give networks alone.
double stage_slowness(double step_slowness);

}  // namespace orbitfuse::planning
