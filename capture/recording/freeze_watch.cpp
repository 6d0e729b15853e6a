// SPDX-License-Identifier: BSD-3-Clause
#include "capture/recording/freeze_watch.hpp"

#include <xxhash.h>

#include <algorithm>

namespace orbitfuse {

/// No shutter opens again this fast.
static constexpr std::chrono::milliseconds longest_repeat{150};

bool FreezeWatch::mark(Frame& frame, const void* samples, std::size_t size, Clock::time_point now) {
  const std::uint64_t hash = XXH3_64bits(samples, size);
  bool begins = false;
  if (hash != hash_) {
    if (last_ - first_ <= longest_repeat) usual_repeat_ = std::max(usual_repeat_, last_ - first_);
    first_ = now;
    frozen_ = false;
  } else if (now - first_ > usual_repeat_ + usual_repeat_ / 4) {  // frames don't come on the dot
    begins = !frozen_;
    frozen_ = true;
    until_ = now + settle_;
  }
  hash_ = hash;
  last_ = now;
  if (now < until_) frame.flag(FrameFlag::nuc);
  return begins;
}

}  // namespace orbitfuse
