// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/sources.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/system/file_io.hpp"
#include "drivers/stills/still_photo.hpp"
#include "drivers/stills/video_frames.hpp"

namespace orbitfuse {

std::string Source::short_name() const {
  const std::string name = (file.parent_path().filename() / file.filename()).string();
  return pages > 1 ? fmt::format("{}#{}", name, page + 1) : name;
}

std::string Source::where() const {
  if (pages == 1) return file.string();
  return fmt::format("{} ({} {})", file.string(), video ? "frame" : "image", page + 1);
}

std::vector<Source> photo_sources(const std::vector<std::filesystem::path>& files) {
  std::vector<Source> sources;
  for (const std::filesystem::path& file : files) {
    Source source;
    source.file = file;
    source.video = has_video_extension(file);
    if (source.video) {
      source.hash = video_fingerprint(file);
      sources.push_back(std::move(source));
      continue;
    }
    const Result<std::string> bytes = read_file(file, max_image_bytes);
    if (bytes) {
      source.hash = content_hash(*bytes);
      const ExifInfo exif = exif_of_photo(*bytes);
      source.taken_ns = exif.taken_ns;
      if (exif.taken_has_offset) source.utc_offset_s = exif.utc_offset_s;
      source.thermal_kind = thermal_jpeg_kind(*bytes);
    }
    sources.push_back(std::move(source));
  }
  return sources;
}

void to_one_clock(std::initializer_list<std::vector<Source>*> lists) {
  const bool all_tell = std::all_of(lists.begin(), lists.end(), [](const auto* sources) {
    return std::all_of(sources->begin(), sources->end(),
                       [](const Source& s) { return !s.taken_ns || s.utc_offset_s; });
  });
  if (all_tell) return;
  for (std::vector<Source>* sources : lists)
    for (Source& source : *sources)
      if (source.taken_ns) *source.taken_ns += source.utc_offset_s.value_or(0) * 1'000'000'000LL;
}

std::vector<Source> in_capture_order(std::vector<Source> sources) {
  const bool all_timed = std::all_of(sources.begin(), sources.end(),
                                     [](const Source& s) { return s.taken_ns.has_value(); });
  if (all_timed) {
    std::stable_sort(sources.begin(), sources.end(),
                     [](const Source& a, const Source& b) { return *a.taken_ns < *b.taken_ns; });
  }
  for (std::size_t i = 0; i < sources.size(); ++i) sources[i].position = static_cast<int>(i);
  return sources;
}

void CopyFilter::take_out(std::vector<Source>& sources, Remarks& remarks) {
  std::erase_if(sources, [&](const Source& source) {
    if (source.hash.empty()) return false;
    const auto [first, is_new] =
        first_.emplace(fmt::format("{}#{}", source.hash, source.page), source);
    if (is_new) return false;
    const KnownView* own = known_.find(source.file);
    if (own && own->cam_from_world && own != known_.find(first->second.file)) return false;
    remarks.left_out(source.short_name(), "the same image as " + first->second.short_name(),
                     "a copy");
    return true;
  });
}

}  // namespace orbitfuse
