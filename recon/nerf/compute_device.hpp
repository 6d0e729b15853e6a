// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "core/result.hpp"

namespace orbitfuse::nerf {

/// Whether fields could be computed on a CUDA device, if there is one (ORBITFUSE_CUDA).
bool built_with_cuda();

/// From here on fields train and render on the first CUDA device; those with Sampling::proposal
/// stay on the processor. Of the whole process, as set_thread_count(): before anything runs.
/// Checkpoints and fields are the same files, and a training gives the same bytes each time, but
/// not the processor's: sums are rounded in another order. Returns the device's name. Error:
/// unavailable (this build or machine has none); the processor goes on computing.
Result<std::string> use_cuda();

}  // namespace orbitfuse::nerf
