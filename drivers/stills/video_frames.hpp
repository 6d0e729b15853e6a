// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.hpp"
#include "core/result.hpp"

namespace orbitfuse {

struct VideoOptions {
  int max_frames = 120;  ///< taken of one video: one every 3 degrees of a loop
  /// Motion of the picture between two frames that are taken, in shares of its width, at least. In
  /// an orbit 0.06 is some 4 degrees.
  double min_step = 0.06;
  double max_edge_px = 1.75;  ///< wider edges are blurred (CoverageOptions::max_visible_edge_px)
  /// Of a longer video the rest is not looked at: half an hour at 60 Hz. Files may never end.
  std::int64_t max_looked_at = 108'000;

  Status validate() const;
};

/// What became of every frame of a video.
struct VideoAccount {
  std::int64_t frames = 0;                ///< decoded and looked at
  std::optional<std::int64_t> announced;  ///< by the file; absent: it does not say
  std::int64_t taken = 0;
  std::int64_t blurred = 0, featureless = 0;  ///< sharpest of their stretch, and yet
  std::int64_t other_size = 0;                ///< than the first
  /// Chosen at the first reading and not reached at the second: the medium fails, or the file was
  /// changed meanwhile.
  std::int64_t not_read_again = 0;
  bool cut_off = false;  ///< there are more than max_looked_at

  /// Passed over for a sharper frame of nearly the same view.
  std::int64_t less_sharp() const {
    return frames - taken - blurred - featureless - other_size - not_read_again;
  }
  /// One sentence.
  std::string words() const;
};

struct VideoFrame {
  std::int64_t index = 0;  ///< in the video, from 0
  /// Since its beginning, by the video's own stamps.
  std::optional<std::int64_t> time_ns;
  cv::Mat image;  ///< CV_8UC3, turned as the video says
};

/// Whether the name or the bytes at the beginning are those of a video that is read (MP4, MOV, MKV,
/// WebM, AVI, MPEG).
bool has_video_extension(const std::filesystem::path& file);
bool is_video(std::string_view beginning);

/// A name for what is in the file without reading all of it; empty: it can't be read.
std::string video_fingerprint(const std::filesystem::path& file);

/// The frames that a guide would take of an orbit that was filmed: the picture has moved on by a
/// step since the last one, and of the frames on the way there the sharpest, if it is sharp at all.
/// The video is read twice. Input error when it can't be read or has no frames; an error of `take`
/// ends it.
Result<VideoAccount> take_video_frames(const std::filesystem::path& file,
                                       const VideoOptions& options, const Progress& progress,
                                       const std::function<Status(VideoFrame)>& take);

}  // namespace orbitfuse
