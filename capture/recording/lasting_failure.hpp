// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace orbitfuse {

/// Decides when attempts that keep failing (a camera that is back but can't be used) are worth
/// telling: once for each reason, and not for what passes within a few attempts.
class LastingFailure {
 public:
  /// After each attempt that failed: whether to tell it now.
  bool note(const std::string& why) {
    if (why != why_) attempts_ = 0;
    why_ = why;
    return ++attempts_ == lasting;
  }
  void clear() { why_.clear(); }

 private:
  static constexpr int lasting = 4;  ///< a second of attempts
  std::string why_;
  int attempts_ = 0;
};

}  // namespace orbitfuse
