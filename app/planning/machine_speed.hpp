// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace orbitfuse::planning {

/// Seconds this machine needs, as it is loaded now, for what takes one second where stage_s() was
/// measured: from half a second of training a field of noise, which is what a run does most.
/// 1 if that can't be told.
double measured_slowness();

}  // namespace orbitfuse::planning
