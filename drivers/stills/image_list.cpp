// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/image_list.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <map>
#include <string_view>

#include "core/image/image_codec.hpp"
#include "drivers/stills/video_frames.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;

bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

std::string extension_of(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

constexpr const char* table = "table";  ///< of temperatures; beside photos it is anything

struct UnreadFormat {
  const char* kind;
  std::string_view extensions;  ///< each between dots
};
/// What phones, cameras and their software leave beside JPEGs.
constexpr std::array<UnreadFormat, 7> unread_formats{
    {{"HEIC", ".heic.heif.hif."},
     {"raw photo", ".dng.cr2.cr3.nef.nrw.arw.orf.rw2.raf.pef.srw."},
     {"video", ".mp4.mov.avi.mkv.m4v.mpg.mpeg.wmv.webm.mts.3gp."},
     {"FLIR recording", ".seq.csq.fff.ats.sfmov.ptw.ravi."},
     {"web image", ".webp.avif.gif.jxl."},
     {"image", ".jp2.j2k.exr.hdr.psd.tga.pgm.ppm.pnm.is2.irg.bmt.mpo."},
     {table, ".csv."}}};

/// End of the digit run at `at` and its start without leading zeros.
std::pair<std::size_t, std::size_t> digit_run(const std::string& s, std::size_t at) {
  std::size_t end = at;
  while (end < s.size() && is_digit(s[end])) ++end;
  while (at + 1 < end && s[at] == '0') ++at;
  return {at, end};
}

/// What a phone's user deleted (".trashed-...jpg"), and what a Mac leaves beside IMG_1.jpg on cards
/// and sticks ("._IMG_1.jpg"), which is no image: in front of all others they would shift the
/// stations of those.
bool is_hidden(const fs::path& file) { return file.filename().string().starts_with("."); }
bool is_of_mac(const fs::path& file) { return file.filename().string().starts_with("._"); }

/// A JPEG, PNG or TIFF by its first bytes; those of a BMP begin many a text.
bool begins_like_an_image(const fs::path& file) {
  std::array<char, 8> read{};
  std::ifstream(file, std::ios::binary).read(read.data(), read.size());
  const ImageFormat format = image_format({read.data(), read.size()});
  return format != ImageFormat::unknown && format != ImageFormat::bmp;
}

bool holds_images(Modality modality, const fs::path& folder) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
    if (entry.is_regular_file(error) && !is_hidden(entry.path()) &&
        has_image_extension(modality, entry.path()))
      return true;
  return false;
}

/// What to do with pictures that are not read. Of a thermal one JPEG would keep no temperatures.
const char* conversion(Modality modality) {
  return modality == Modality::thermal
             ? "convert them to 16-bit TIFF or PNG (100 x kelvin), which keep temperatures"
             : "convert them to JPEG";
}

/// A file may be named once. A link to a sibling is no second naming: a camera's program leaves it
/// beside the files ("latest.jpg").
Status take_out_links(ImageList& list) {
  std::vector<fs::path>& files = list.images;
  std::error_code error;
  std::stable_partition(files.begin(), files.end(),
                        [&](const fs::path& file) { return !fs::is_symlink(file, error); });
  std::map<fs::path, fs::path> seen;  // by the name without links
  std::vector<fs::path> kept;
  for (const fs::path& file : files) {
    const fs::path one_name = fs::weakly_canonical(file, error);
    const auto [first, is_new] = seen.emplace(error ? file : one_name, file);
    if (is_new) {
      kept.push_back(file);
      continue;
    }
    const fs::path& other = first->second;
    if (file.filename() == other.filename() || file.parent_path() != other.parent_path())
      return fail(ErrorKind::usage, file.string(), "given twice", "name each folder and file once");
    list.links.emplace_back(file, other);
  }
  files = std::move(kept);
  return {};
}

}  // namespace

bool has_image_extension(Modality modality, const fs::path& path) {
  constexpr std::array<std::string_view, 8> both{".jpg", ".jpeg", ".jpe",  ".jfif",
                                                 ".png", ".tif",  ".tiff", ".bmp"};
  constexpr std::array<std::string_view, 3> photos{".heic", ".heif", ".hif"},
      recordings{".seq", ".csq", ".fff"};
  const auto is_one_of = [extension = extension_of(path)](const auto& list) {
    return std::find(list.begin(), list.end(), extension) != list.end();
  };
  return is_one_of(both) || is_one_of(modality == Modality::thermal ? recordings : photos);
}

bool natural_less(const std::string& a, const std::string& b) {
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (is_digit(a[i]) && is_digit(b[j])) {
      const auto [ai, ae] = digit_run(a, i);
      const auto [bi, be] = digit_run(b, j);
      if (ae - ai != be - bi) return ae - ai < be - bi;
      if (const int c = a.compare(ai, ae - ai, b, bi, be - bi); c != 0) return c < 0;
      i = ae;
      j = be;
    } else {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
    }
  }
  if (a.size() - i != b.size() - j) return a.size() - i < b.size() - j;
  return a < b;  // "1" and "01": any fixed order
}

std::string unread_kind(const fs::path& file) {
  const std::string extension = extension_of(file) + ".";
  for (const UnreadFormat& format : unread_formats) {
    if (extension.size() > 2 && format.extensions.find(extension) != std::string_view::npos)
      return format.kind;
  }
  return {};
}

Result<ImageList> list_images(Modality modality, const std::vector<fs::path>& paths) {
  ImageList list;
  std::vector<fs::path>& files = list.images;
  for (const fs::path& path : paths) {
    std::error_code error;
    if (path.empty())
      return fail(ErrorKind::usage, "images", "an empty name", "name a folder or a file");
    if (fs::is_regular_file(path, error)) {
      files.push_back(path);
      continue;
    }
    fs::directory_iterator folder(path, error);
    if (error) {
      return fail(
          ErrorKind::input, path.string(), error.message(),
          error == std::errc::permission_denied ? "check its permissions" : "check the path");
    }
    const std::size_t before = files.size(), unread_before = list.unread.size(),
                      nameless_before = list.nameless.size();
    std::vector<fs::path> videos;
    for (const fs::directory_entry& entry : folder) {
      const bool is_folder = entry.is_directory(error);
      if (is_folder && holds_images(modality, entry.path())) list.folders.push_back(entry.path());
      if (is_folder || is_of_mac(entry.path())) continue;
      if (is_hidden(entry.path())) {
        if (has_image_extension(modality, entry.path())) list.hidden.push_back(entry.path());
        continue;
      }
      if (!entry.is_regular_file(error)) {
        if (has_image_extension(modality, entry.path())) list.no_files.push_back(entry.path());
        continue;
      }
      if (has_image_extension(modality, entry.path()))
        files.push_back(entry.path());
      else if (modality == Modality::visible && has_video_extension(entry.path()))
        videos.push_back(entry.path());
      else if (const std::string kind = unread_kind(entry.path());
               !kind.empty() && (kind != table || modality == Modality::thermal))
        list.unread.push_back(entry.path());
      else if (!entry.path().has_extension() && !entry.is_symlink(error) &&
               begins_like_an_image(entry.path()))
        list.nameless.push_back(entry.path());
    }
    // Phones leave a clip of seconds beside each photo: among photos a video is taken for one.
    std::vector<fs::path>& wanted = files.size() == before ? files : list.videos_among_photos;
    wanted.insert(wanted.end(), videos.begin(), videos.end());
    if (files.size() == before && list.nameless.size() > nameless_before)
      return fail(ErrorKind::input, path.string(),
                  fmt::format("{} images whose names have no extension ({})",
                              list.nameless.size() - nameless_before,
                              list.nameless.back().filename().string()),
                  "rename them (.jpg, .png, .tiff)");
    if (files.size() == before) {
      const bool other = list.unread.size() > unread_before;
      return fail(
          ErrorKind::input, path.string(),
          other ? fmt::format("no JPEG, PNG, TIFF, BMP, HEIC or video in the folder, but {} of "
                              "another format ({})",
                              list.unread.size() - unread_before,
                              list.unread.back().filename().string())
                : "no images (jpg, png, tif, bmp, heic) or videos in the folder",
          other ? conversion(modality) : "give the folder that holds the images themselves");
    }
  }
  ORBITFUSE_TRY(take_out_links(list));
  std::stable_sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  std::sort(list.unread.begin(), list.unread.end());
  std::sort(list.nameless.begin(), list.nameless.end());
  std::sort(list.hidden.begin(), list.hidden.end());
  std::sort(list.no_files.begin(), list.no_files.end());
  std::sort(list.videos_among_photos.begin(), list.videos_among_photos.end());
  return list;
}

}  // namespace orbitfuse
