// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/cli/verb.hpp"
#include "app/recording/open_cameras.hpp"
#include "app/recording/recording.hpp"
#include "capture/page/capture_page.hpp"

namespace orbitfuse::cli {

/// What `orbitfuse capture` was asked for. Absent: not given.
struct CaptureOptions {
  std::string session, driver, visible, thermal, profiles, guide = "auto";
  std::optional<std::string> mat;
  std::optional<int> mat_tags;
  std::optional<double> spacing_deg, turntable_deg;
  double seconds = 0;
  std::vector<double> elevations_deg, max_edge_px;
  bool stop_when_complete = false, view = false, wait_for_start = false;
  std::string page, token;

  /// Usage error naming the option, its value and what it takes.
  Status validate() const;
};

void add_capture_options(CLI::App& app, CaptureOptions& options);

/// The cameras named, not started.
Result<recording::Cameras> cameras_of(const CaptureOptions& options);
/// The orbits to be walked: the command line's, else those of the stations that the frames carry.
Result<std::optional<LiveGuideOptions>> guide_of(const CaptureOptions& options,
                                                 const recording::Cameras& cameras);
/// Finds the mat in what live cameras see; frames that carry their stations need none.
Result<PositionFinder> finder_of(const CaptureOptions& options, const recording::Cameras& cameras);
/// Of "PORT", "HOST:PORT" or "[IPv6]:PORT".
Result<PageOptions> page_of(const CaptureOptions& options);

}  // namespace orbitfuse::cli
