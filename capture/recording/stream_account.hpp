// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/session/session.hpp"

namespace orbitfuse {

/// Where every id of one stream went. Ids rise strictly; each seen id is settled exactly once, as
/// received or lost, and each skipped id is missing. Then received + lost == last - first + 1.
/// `next_id`: where the stream goes on after an earlier recording; ids skipped from there are
/// missing. Thread-safe: ids are seen on the capture thread and settled on the writer thread.
class StreamAccount {
 public:
  explicit StreamAccount(std::string device, std::optional<std::uint64_t> next_id = std::nullopt)
      : device_(std::move(device)), next_id_(next_id) {}

  /// False when the id does not rise: such a delivery has no place in the stream.
  bool see(std::uint64_t id);
  void receive();
  enum class Loss { missing, rejected, dropped, unwritten };
  void lose(std::uint64_t id, Loss loss, const std::string& reason);
  /// Nothing came up to this id, itself included. Without any id before it the stream has no span
  /// that this could be the end of.
  void miss_until(std::uint64_t last_id, const std::string& reason);

  struct Counts {
    std::uint64_t received = 0, missing = 0, rejected = 0, dropped = 0, unwritten = 0;
    std::uint64_t first = 0, last = 0;
    bool any = false;
    std::uint64_t lost() const { return missing + rejected + dropped + unwritten; }
  };
  Counts counts() const;
  /// Takes back what was said of the ids from `first` on, none of them received and no gap among
  /// them taken: they come again.
  void forget_from(std::uint64_t first);
  /// Gaps not yet written; neighbours with one reason are one gap. Those before a frame's id cannot
  /// grow any more once it is that frame's turn to be stored; nullopt: all.
  std::vector<GapRecord> take_gaps(std::optional<std::uint64_t> frame_id);
  StreamRecord record() const;

 private:
  struct Gap {
    GapRecord record;
    Loss loss;
  };
  void add_gap(std::uint64_t first, std::uint64_t count, Loss loss, const std::string& reason);
  std::uint64_t& count_of(Loss loss);

  std::string device_;
  mutable std::mutex mutex_;
  std::optional<std::uint64_t> next_id_;  ///< the lowest that may come
  Counts counts_;
  std::vector<Gap> gaps_;
};

}  // namespace orbitfuse
