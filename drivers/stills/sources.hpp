// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "drivers/stills/known_poses.hpp"
#include "drivers/stills/remarks.hpp"

namespace orbitfuse {

/// One image to import: a file, or a page of one.
struct Source {
  std::filesystem::path file;
  int page = 0, pages = 1;
  bool video = false;                  ///< some of its frames become images
  const char* thermal_kind = nullptr;  ///< of a thermal camera's JPEG among photos: "FLIR", "DJI"
  std::string hash;                    ///< of the file's bytes; empty: it can't be read
  std::optional<std::int64_t> taken_ns;
  std::optional<std::int64_t> utc_offset_s;  ///< local time less UTC, where the file tells it
  int position = 0;  ///< in capture order, counting files that turn out unreadable

  /// Folder and file: enough to tell "visible/000.jpg" from "thermal/000.jpg" on any machine.
  std::string short_name() const;
  /// The whole path; of one image among several also its number.
  std::string where() const;
};

/// Photos and videos with the times that they name themselves.
std::vector<Source> photo_sources(const std::vector<std::filesystem::path>& files);

/// Leaves the times as they are, UTC, where every file that has one tells its offset; else all
/// become local times: a photo without an offset can be compared with others only so.
void to_one_clock(std::initializer_list<std::vector<Source>*> lists);

/// Capture order: by time where every file has one (file name breaks ties of one-second clocks),
/// else by name. Sets the positions.
std::vector<Source> in_capture_order(std::vector<Source> sources);

/// Tells copies: the same bytes under another name say nothing new, and a view twice in the same
/// place spoils what is estimated from pairs. Two views whose poses are both known are two views.
class CopyFilter {
 public:
  explicit CopyFilter(const KnownViews& known) : known_(known) {}
  /// Takes copies out of `sources`, and says so.
  void take_out(std::vector<Source>& sources, Remarks& remarks);

 private:
  const KnownViews& known_;
  std::map<std::string, Source> first_;  ///< by content
};

}  // namespace orbitfuse
