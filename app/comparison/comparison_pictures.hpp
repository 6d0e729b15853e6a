// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "app/comparison/compare_runs.hpp"

namespace orbitfuse::comparing {

/// A visible camera of AFTER, and what differs as it sees it. CV_8UC3 of one size.
struct ComparisonPictures {
  std::string view;    ///< the photo's file in AFTER's session
  cv::Mat before;      ///< BEFORE's visible field, rendered by the same camera
  cv::Mat after;       ///< the photo, without the lens's distortion
  cv::Mat difference;  ///< in difference_colors over the photo's grays, regions numbered
};

/// BGR, CV_8UC3 1x256: blue (colder) over white to red (warmer).
cv::Mat difference_colors();
/// The colours' ends are at plus and minus this: one span for all pictures and files.
double difference_span_k(const ComparedRuns& runs);
/// What a vertex looks like in files: its difference's colour, or that of what has none.
cv::Vec3b color_of(const ComparedRuns& runs, std::size_t vertex, double span_k);
inline const cv::Vec3b changed_bgr{200, 0, 200}, unknown_bgr{128, 128, 128};

/// Of up to four views round the object, and of what sees the largest difference best. Errors:
/// input (a photo that can't be read), the renderer's, cancelled.
Result<std::vector<ComparisonPictures>> pictures_of(const ComparedRuns& runs,
                                                    const Progress& progress);

}  // namespace orbitfuse::comparing
