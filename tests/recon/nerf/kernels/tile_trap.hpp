// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace orbitfuse::nerf::test {

/// While it lives, AMX instructions that this processor doesn't know (SIGILL) are decoded and
/// executed by a TileMachine: the compiled kernels run as they are. One thread at a time.
class TileTrap {
 public:
  TileTrap();
  ~TileTrap();
  TileTrap(const TileTrap&) = delete;
  TileTrap& operator=(const TileTrap&) = delete;

  int executed() const;  ///< instructions so far
  bool configured() const;
};

}  // namespace orbitfuse::nerf::test
