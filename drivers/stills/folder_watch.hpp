// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace orbitfuse {

/// Tells which files of a folder are ready to be read. The kernel says when a writer closed a file
/// or moved it in (inotify); where it can't (network and phone file systems, queue overflow), a
/// file counts as ready when its size and time stood still for `settle`. Files that are still
/// hidden or temporary by name ("IMG.jpg.part", ".IMG.jpg.swp") are left alone.
class FolderWatch {
 public:
  FolderWatch(std::filesystem::path folder, std::chrono::milliseconds settle,
              std::chrono::milliseconds rescan);
  ~FolderWatch();
  FolderWatch(const FolderWatch&) = delete;
  FolderWatch& operator=(const FolderWatch&) = delete;

  /// With `existing` the files that are there already are ready too. Input error when the folder
  /// is missing or unreadable.
  Status open(bool existing);
  void close();

  /// Files that became ready, in natural name order; waits at most `timeout`. A file is told again
  /// when it is written again. While the folder is gone nothing is ready.
  std::vector<std::filesystem::path> wait(std::chrono::milliseconds timeout);
  /// Files that are there and were never ready: still written, or empty.
  std::vector<std::filesystem::path> untold() const;
  bool folder_gone() const { return gone_; }

 private:
  using Clock = std::chrono::steady_clock;
  struct State {
    std::uintmax_t size = 0;
    std::filesystem::file_time_type written;
    bool operator==(const State&) const = default;
  };
  struct Candidate {
    State state;
    Clock::time_point since;
    bool closed = false;
  };
  std::map<std::string, State> list() const;
  bool watch();
  void read_events();
  std::vector<std::filesystem::path> rescan();

  std::filesystem::path folder_;
  std::chrono::milliseconds settle_, rescan_every_;
  int fd_ = -1, watch_ = -1;
  bool gone_ = false;
  std::set<std::string> closed_;  ///< names that the kernel says are whole
  std::map<std::string, Candidate> candidates_;
  std::map<std::string, State> told_;
  Clock::time_point last_scan_{};
};

}  // namespace orbitfuse
