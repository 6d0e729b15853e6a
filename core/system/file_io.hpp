// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace orbitfuse {

/// Whole file as bytes; input error naming the file when it is missing or unreadable.
Result<std::string> read_file(const std::filesystem::path& path);

/// Writes to a temporary beside the target, fsyncs, renames, fsyncs the folder: readers see the
/// old content or the new, never a part. Creates missing parent folders. Device error (with the
/// free space found) when the disk is full; the old file is then intact.
Status write_file_atomic(const std::filesystem::path& path, std::string_view bytes);

/// Makes renames and new files in the folder survive a power cut.
Status sync_folder(const std::filesystem::path& folder);

/// 128-bit content hash (XXH3), hex. Not for security.
std::string content_hash(std::string_view bytes);
Result<std::string> file_hash(const std::filesystem::path& path);

}  // namespace orbitfuse
