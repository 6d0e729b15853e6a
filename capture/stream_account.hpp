// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/session.hpp"

namespace orbitfuse {

/// Where every id of one stream went. Ids rise strictly; each seen id is settled exactly once, as
/// received or lost, and each skipped id is missing. Then received + lost == last - first + 1.
/// Thread-safe: ids are seen on the capture thread and settled on the writer thread.
class StreamAccount {
 public:
  explicit StreamAccount(std::string device) : device_(std::move(device)) {}

  /// False when the id does not rise: such a delivery has no place in the stream.
  bool see(std::uint64_t id);
  void receive();
  enum class Loss { missing, rejected, dropped };
  void lose(std::uint64_t id, Loss loss, const std::string& reason);

  struct Counts {
    std::uint64_t received = 0, missing = 0, rejected = 0, dropped = 0, first = 0, last = 0;
    bool any = false;
    std::uint64_t lost() const { return missing + rejected + dropped; }
  };
  Counts counts() const;
  /// Gaps not yet written; neighbours with one reason are one gap. Those before the id that was
  /// stored last cannot grow any more; nullopt: all.
  std::vector<GapRecord> take_gaps(std::optional<std::uint64_t> stored_id);
  StreamRecord record() const;

 private:
  void add_gap(std::uint64_t first, std::uint64_t count, const std::string& reason);

  std::string device_;
  mutable std::mutex mutex_;
  Counts counts_;
  std::vector<GapRecord> gaps_;
};

}  // namespace orbitfuse
