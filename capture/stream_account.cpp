// SPDX-License-Identifier: BSD-3-Clause
#include "capture/stream_account.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace orbitfuse {

bool StreamAccount::see(std::uint64_t id) {
  const std::lock_guard lock(mutex_);
  if (!counts_.any) {
    counts_.any = true;
    counts_.first = counts_.last = id;
    return true;
  }
  if (id <= counts_.last) return false;
  if (const std::uint64_t skipped = id - counts_.last - 1; skipped > 0) {
    counts_.missing += skipped;
    add_gap(counts_.last + 1, skipped, "missing");
  }
  counts_.last = id;
  return true;
}

void StreamAccount::receive() {
  const std::lock_guard lock(mutex_);
  ++counts_.received;
}

void StreamAccount::lose(std::uint64_t id, Loss loss, const std::string& reason) {
  const std::lock_guard lock(mutex_);
  ++(loss == Loss::missing ? counts_.missing : loss == Loss::rejected ? counts_.rejected : counts_.dropped);
  add_gap(id, 1, reason);
}

void StreamAccount::add_gap(std::uint64_t first, std::uint64_t count, const std::string& reason) {
  if (!gaps_.empty() && gaps_.back().reason == reason &&
      gaps_.back().first_sequence + gaps_.back().count == first) {
    gaps_.back().count += count;
    return;
  }
  gaps_.push_back({device_, first, count, reason});
}

StreamAccount::Counts StreamAccount::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

std::vector<GapRecord> StreamAccount::take_gaps(std::optional<std::uint64_t> stored_id) {
  const std::lock_guard lock(mutex_);
  const auto over = std::stable_partition(gaps_.begin(), gaps_.end(), [&](const GapRecord& gap) {
    return !stored_id || gap.first_sequence < *stored_id;
  });
  std::vector<GapRecord> out(std::make_move_iterator(gaps_.begin()), std::make_move_iterator(over));
  gaps_.erase(gaps_.begin(), over);
  return out;
}

StreamRecord StreamAccount::record() const {
  const Counts c = counts();
  return {device_, c.first, c.last, c.received, c.lost()};
}

}  // namespace orbitfuse
