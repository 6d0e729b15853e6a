// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace orbitfuse {

/// A file is read whole, so its size is bounded by what it may sensibly hold: a name that leads to
/// something endless (a device, a sparse file) must cost neither the memory nor the time.
inline constexpr std::uint64_t max_file_bytes = 2ull << 30;  ///< anything: a cloud, a field
inline constexpr std::uint64_t max_image_bytes = 1ull << 30;
inline constexpr std::uint64_t max_text_bytes = 256ull << 20;    ///< poses of many frames
inline constexpr std::uint64_t max_settings_bytes = 4ull << 20;  ///< configurations, sidecars

/// Whole file as bytes. Input error naming the file when it is missing or unreadable, when it is no
/// regular file (a folder, a device, a pipe) and when it is larger than `at_most`: before reading.
Result<std::string> read_file(const std::filesystem::path& path,
                              std::uint64_t at_most = max_file_bytes);

/// Writes to a temporary beside the target, fsyncs, renames, fsyncs the folder: readers see the
/// old content or the new, never a part. Creates missing parent folders. Device error (with the
/// free space found) when the disk is full; the old file is then intact.
Status write_file_atomic(const std::filesystem::path& path, std::string_view bytes);

/// Makes renames and new files in the folder survive a power cut.
Status sync_folder(const std::filesystem::path& folder);

/// 128-bit content hash (XXH3), hex. Not for security.
std::string content_hash(std::string_view bytes);
/// Of a regular file of any size, read in pieces.
Result<std::string> file_hash(const std::filesystem::path& path);

}  // namespace orbitfuse
