// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/modality.hpp"
#include "core/result.hpp"

namespace orbitfuse {

struct ImageList {
  std::vector<std::filesystem::path> images;
  /// Pictures and videos in formats that are not read: who put them there expects them.
  std::vector<std::filesystem::path> unread;
  /// Images by their first bytes, whose names have no extension.
  std::vector<std::filesystem::path> nameless;
  /// Named like images, but nothing that could be read: links to nothing, pipes, devices.
  std::vector<std::filesystem::path> no_files;
  /// Their names begin with a dot: deleted ones of a phone. Without those that a Mac leaves.
  std::vector<std::filesystem::path> hidden;
  /// In a folder that also holds photos: they may be parts of those (Live Photos), so they are
  /// taken only where they are named, or from a folder of videos alone.
  std::vector<std::filesystem::path> videos_among_photos;
  /// Folders in a given one that hold images too: nothing looks into them.
  std::vector<std::filesystem::path> folders;
  /// A link beside the file that it leads to ("latest.jpg"), and that file: one image.
  std::vector<std::pair<std::filesystem::path, std::filesystem::path>> links;
};

/// Image files named by the paths: files as given, folders without their sub-folders. In natural
/// name order ("9.jpg" before "10.jpg"), of folders without hidden ones (".9.jpg"). FLIR
/// recordings are thermal images, videos and HEIC visible ones. Input error when a path is missing
/// or has no images.
Result<ImageList> list_images(Modality modality, const std::vector<std::filesystem::path>& paths);

/// By its name's ending: ".jpg" in any case of letters, ".heic" for photos, ".seq" for thermal.
bool has_image_extension(Modality modality, const std::filesystem::path& file);

/// "HEIC", "video" and the like for the name of a picture or video that is not read; else empty.
std::string unread_kind(const std::filesystem::path& file);

/// Natural order: digit runs compare as numbers.
bool natural_less(const std::string& a, const std::string& b);

}  // namespace orbitfuse
