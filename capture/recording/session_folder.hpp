// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "core/result.hpp"

// Whether a folder can become a session, before anything is written there.
namespace orbitfuse {

/// Recording begins and goes on only while the disk has this much left: what other programs write
/// meanwhile must not cut a frame.
inline constexpr std::uint64_t min_free_session_bytes = 64ull << 20;

/// On the disk of the folder or, while it doesn't exist, of its nearest parent that does.
std::optional<std::uint64_t> free_bytes_at(const std::filesystem::path& folder);

/// Device error saying what is free and what is needed, with the remedy given.
Status check_free_space(const std::filesystem::path& folder, std::uint64_t needed_bytes,
                        const char* remedy = "free disk space, or record to another disk");

bool holds_session(const std::filesystem::path& folder);

/// Whether a process has the session open for recording. False where the folder can't be asked.
bool is_being_recorded(const std::filesystem::path& folder);

/// The folder must not exist or be empty. Input error otherwise.
Status check_is_new(const std::filesystem::path& folder);

/// Makes a folder and its missing parents. Those that are still empty go again with this object,
/// unless they are kept: what was refused leaves nothing behind.
class MadeFolders {
 public:
  MadeFolders() = default;
  ~MadeFolders();
  MadeFolders(const MadeFolders&) = delete;
  MadeFolders& operator=(const MadeFolders&) = delete;

  Status make(const std::filesystem::path& folder);
  void keep() { made_.clear(); }

 private:
  std::vector<std::filesystem::path> made_;  ///< parents first
};

}  // namespace orbitfuse
