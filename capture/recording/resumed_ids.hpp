// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace orbitfuse {

/// Ids of a source of finitely many frames, counted by itself, that goes on with a session. They
/// keep the distance to the source's own count that they had there, so that what is missing in the
/// source is missing in the session too. No id is given twice: a frame under an id that the session
/// counts as lost comes under a new one, and so do those after it.
class ResumedIds {
 public:
  /// The session knows frame `own` as `recorded`, and accounts for every id before `next_id`.
  void go_on(std::uint64_t own, std::uint64_t recorded, std::uint64_t next_id) {
    offset_ = recorded - own;
    next_id_ = next_id;
  }
  /// Of a frame after the known one: whether the session has settled what became of it.
  bool settled(std::uint64_t own) const { return own + offset_ < next_id_; }
  std::uint64_t give(std::uint64_t own) {
    if (settled(own)) offset_ = next_id_ - own;
    return own + offset_;
  }

 private:
  std::uint64_t offset_ = 0;  ///< modulo 2^64
  std::uint64_t next_id_ = 0;
};

}  // namespace orbitfuse
