// SPDX-License-Identifier: BSD-3-Clause
#include "core/memory.hpp"

#include <malloc.h>

namespace orbitfuse {

void keep_freed_memory() {
  mallopt(M_MMAP_THRESHOLD, 32 << 20);  // the largest that glibc takes
  mallopt(M_TRIM_THRESHOLD, 128 << 20);
}

}  // namespace orbitfuse
