// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "app/inspection/findings.hpp"
#include "app/inspection/pictures.hpp"
#include "app/report/report_model.hpp"

namespace orbitfuse::inspection {

struct ShownFinding {
  InspectionFinding finding;
  FindingPictures pictures;
};

/// All that an inspection report shows.
struct InspectionModel {
  std::string title;
  report::Facts cover, cameras, conditions, radiometry;
  std::string plan_svg;
  std::vector<ShownFinding> findings;
  std::vector<PriorityClass> classes;
  std::vector<std::string> limits;
  TemperatureSpan span;                    ///< of the thermal pictures
  cv::Mat palette_bgr;                     ///< 1x256
  std::optional<fusion::HeatLegend> heat;  ///< of the fused ones
  std::string run, software, created;
};

/// One HTML page that needs no other file, no script and no network, made to be printed on A4.
std::string to_html(const InspectionModel& model);

}  // namespace orbitfuse::inspection
