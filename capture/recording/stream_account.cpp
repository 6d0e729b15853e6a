// SPDX-License-Identifier: BSD-3-Clause
#include "capture/recording/stream_account.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace orbitfuse {

bool StreamAccount::see(std::uint64_t id) {
  const std::lock_guard lock(mutex_);
  const std::uint64_t expected = next_id_.value_or(id);
  if (id < expected) return false;
  if (!counts_.any) counts_.first = expected;
  counts_.any = true;
  if (id > expected) add_gap(expected, id - expected, Loss::missing, "missing");
  counts_.last = id;
  next_id_ = id + 1;
  return true;
}

void StreamAccount::receive() {
  const std::lock_guard lock(mutex_);
  ++counts_.received;
}

void StreamAccount::lose(std::uint64_t id, Loss loss, const std::string& reason) {
  const std::lock_guard lock(mutex_);
  add_gap(id, 1, loss, reason);
}

void StreamAccount::miss_until(std::uint64_t last_id, const std::string& reason) {
  const std::lock_guard lock(mutex_);
  if (!counts_.any || !next_id_ || last_id < *next_id_) return;
  add_gap(*next_id_, last_id - *next_id_ + 1, Loss::missing, "missing: " + reason);
  counts_.last = last_id;
  next_id_ = last_id + 1;
}

std::uint64_t& StreamAccount::count_of(Loss loss) {
  switch (loss) {
    case Loss::missing:
      return counts_.missing;
    case Loss::rejected:
      return counts_.rejected;
    case Loss::dropped:
      return counts_.dropped;
    case Loss::unwritten:
      break;
  }
  return counts_.unwritten;
}

void StreamAccount::add_gap(std::uint64_t first, std::uint64_t count, Loss loss,
                            const std::string& reason) {
  count_of(loss) += count;
  if (!gaps_.empty()) {
    GapRecord& latest = gaps_.back().record;
    if (latest.reason == reason && latest.first_sequence + latest.count == first) {
      latest.count += count;
      return;
    }
  }
  gaps_.push_back({{device_, first, count, reason}, loss});
}

void StreamAccount::forget_from(std::uint64_t first) {
  const std::lock_guard lock(mutex_);
  std::erase_if(gaps_, [&](const Gap& gap) {
    if (gap.record.first_sequence < first) return false;
    count_of(gap.loss) -= gap.record.count;
    return true;
  });
  if (counts_.first >= first) counts_ = {};
  counts_.last = counts_.any ? first - 1 : 0;
  next_id_ = first;
}

StreamAccount::Counts StreamAccount::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

std::vector<GapRecord> StreamAccount::take_gaps(std::optional<std::uint64_t> frame_id) {
  const std::lock_guard lock(mutex_);
  const auto over = std::stable_partition(gaps_.begin(), gaps_.end(), [&](const Gap& gap) {
    return !frame_id || gap.record.first_sequence < *frame_id;
  });
  std::vector<GapRecord> out;
  std::transform(gaps_.begin(), over, std::back_inserter(out),
                 [](Gap& gap) { return std::move(gap.record); });
  gaps_.erase(gaps_.begin(), over);
  return out;
}

StreamRecord StreamAccount::record() const {
  const Counts c = counts();
  return {device_, c.first, c.last, c.received, c.lost()};
}

}  // namespace orbitfuse
