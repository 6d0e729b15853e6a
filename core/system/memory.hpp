// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

namespace orbitfuse {

/// Freed blocks of up to 32 MB stay with the process (128 MB at most) instead of going back to the
/// kernel, which would hand out zeroed pages for every new image: that took up to half the CPU time
/// of a fusion. Once, from main().
void keep_freed_memory();

/// Asks the kernel for pages of 2 MB where it has them: tables that are read in random order miss
/// the TLB otherwise. For memory not written to yet; only advice, errors don't matter.
void advise_huge_pages(void* begin, std::size_t bytes);

/// Room for `count` values on huge pages; before the vector is filled.
template <typename T>
void reserve_huge(std::vector<T>& values, std::size_t count) {
  if (values.capacity() >= count) return;
  values.reserve(count);
  advise_huge_pages(values.data(), count * sizeof(T));
}

}  // namespace orbitfuse
