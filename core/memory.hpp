// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace orbitfuse {

/// Freed blocks of up to 32 MB stay with the process (128 MB at most) instead of going back to the
/// kernel, which would hand out zeroed pages for every new image: that took up to half the CPU time
/// of a fusion. Once, from main().
void keep_freed_memory();

}  // namespace orbitfuse
