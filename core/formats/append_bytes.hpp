// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstring>
#include <string>

namespace orbitfuse {

/// Appends a value as it lies in memory: little-endian on every machine that AVX2 admits.
template <class T>
void append_bytes(std::string& out, T value) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), &value, sizeof value);
  out.append(raw.data(), raw.size());
}

}  // namespace orbitfuse
