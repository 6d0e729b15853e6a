// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "app/inspection/findings.hpp"
#include "app/view/finished_run.hpp"
#include "recon/measurement/thermal_scene.hpp"

namespace orbitfuse::inspection {

/// A finding from one recorded camera, without the lens's distortion, its place marked. An empty
/// picture is not to be had.
struct FindingPictures {
  std::string view;           ///< the camera's frame; empty: none sees the place
  bool thermal_view = false;  ///< one that measured; else a visible one, where none did
  bool doubtful = false;      ///< its pose
  cv::Mat visible;            ///< CV_8UC3, rendered
  cv::Mat thermal;  ///< CV_8UC3, the frame as it was recorded, in the run's palette and span
  bool thermal_is_hatched = false;  ///< somewhere, where its frame has no temperature
  cv::Mat fused;                    ///< CV_8UC3, rendered
  std::string marks;                ///< what is drawn, in words
};

/// From the thermal frame that sees it best (TemperatureReading::best), or else the visible view
/// that sees it nearest and unhidden. Errors: input (a frame that can't be read), cancelled.
Result<FindingPictures> pictures_of(const InspectionFinding& finding, const view::FinishedRun& run,
                                    const measurement::ThermalScene& scene,
                                    const Progress& progress);

}  // namespace orbitfuse::inspection
