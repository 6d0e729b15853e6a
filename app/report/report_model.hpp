// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/pipeline/stage.hpp"
#include "core/image/palette.hpp"
#include "fusion/heat/legend.hpp"

namespace orbitfuse::report {

struct FusedImage {
  std::string method;
  cv::Mat image;  ///< CV_8UC1 or CV_8UC3
};

/// One camera seen by every field; an empty image was not rendered.
struct View {
  std::string name;
  cv::Mat visible;        ///< CV_8UC3
  cv::Mat thermal;        ///< CV_8UC3, in the palette
  cv::Mat temperature_k;  ///< CV_32FC1, NaN = none; for the readout
  std::vector<FusedImage> fused;
};

/// One attempt of the pose ladder: what was tried and what came of it.
struct PoseAttempt {
  std::string name, outcome, detail;
};

struct PosesSummary {
  std::string modality;
  int posed = 0, total = 0;
  std::vector<PoseAttempt> ladder;
  std::string found;   ///< how, how well, and where the files are; empty when none are posed
  std::string advice;  ///< what to do about the missing ones; empty when all are posed
};

struct Column {
  std::string name;
  std::string definition;  ///< shown under the table and as a tooltip
};

struct Table {
  std::string title;
  std::vector<Column> columns;  ///< the first is the row's name
  std::vector<std::vector<std::string>> rows;
};

using Facts = std::vector<std::pair<std::string, std::string>>;

struct Model {
  std::string title, subtitle;
  Facts headline;                    ///< the figures at the top
  std::vector<std::string> notices;  ///< what these data did not allow, in words
  std::vector<View> views;
  TemperatureSpan span;
  bool has_temperature = false;            ///< the span is in kelvin (else gray levels)
  cv::Mat palette_bgr;                     ///< 1x256
  std::optional<fusion::HeatLegend> heat;  ///< what the colours of the heat pictures stand for
  std::vector<PosesSummary> poses;
  std::string registration_note;
  Facts registration;
  std::vector<Table> tables;
  Table measurements;  ///< saved in the run's folder; no rows: none
  std::vector<pipeline::StageStatus> stages;
  std::vector<std::string> warnings;
  std::string software, made, configuration;  ///< configuration: resolved, as TOML or JSON
};

/// One HTML page that needs no other file and no network.
std::string to_html(const Model& model);

}  // namespace orbitfuse::report
