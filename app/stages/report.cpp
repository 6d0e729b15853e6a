// SPDX-License-Identifier: BSD-3-Clause
#include <opencv2/imgproc.hpp>

#include "app/stages/report_content.hpp"
#include "app/stages/stage_list.hpp"
#include "core/image/image_io.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::stages {
namespace {

constexpr int picture_height_px = 300;

/// The first view's visible, infrared and fused image side by side, to pass on; heat with its bar.
Status write_picture(const std::filesystem::path& folder, const report::Model& model) {
  if (model.views.empty()) return {};
  const report::View& view = model.views.front();
  std::vector<cv::Mat> parts{view.visible, view.thermal};
  if (!view.fused.empty()) parts.push_back(view.fused.front().image);
  cv::Mat row;
  for (const cv::Mat& part : parts) {
    if (part.empty()) continue;
    cv::Mat color = part, sized;
    if (part.channels() == 1) cv::cvtColor(part, color, cv::COLOR_GRAY2BGR);
    cv::resize(color, sized, {color.cols * picture_height_px / color.rows, picture_height_px}, 0, 0,
               cv::INTER_AREA);
    if (row.empty())
      row = sized;
    else
      cv::hconcat(row, sized, row);
  }
  if (row.empty()) return {};
  if (model.heat && !view.fused.empty() && view.fused.front().method == "heat") {
    ORBITFUSE_ASSIGN(row, fusion::with_heat_legend(row, *model.heat));
  }
  return write_jpeg(folder / "picture.jpg", row, 88);
}

}  // namespace

pipeline::Stage report_stage(const StageInputs& in) {
  pipeline::Stage stage;
  stage.name = "report";
  stage.uses = {"poses_visible", "poses_thermal", "depth", "train_visible", "train_thermal",
                "register",      "render",        "fuse",  "metrics"};
  stage.always = true;
  stage.run = [in](const pipeline::StageContext& context) -> Result<pipeline::StageOutput> {
    ORBITFUSE_ASSIGN(const report::Model model, report_content(context, in));
    ORBITFUSE_TRY(write_file_atomic(context.folder / "report.html", report::to_html(model)));
    ORBITFUSE_TRY(write_picture(context.folder, model));
    pipeline::StageOutput output;
    output.metrics["brief"] = "report.html";
    return output;
  };
  return stage;
}

}  // namespace orbitfuse::stages
