// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/report_content.hpp"
#include "app/stages/stage_list.hpp"
#include "core/file_io.hpp"

namespace orbitfuse::stages {

pipeline::Stage report_stage(const StageInputs& in) {
  pipeline::Stage stage;
  stage.name = "report";
  stage.uses = {"poses_visible", "poses_thermal", "depth",   "train_visible", "train_thermal",
                "register",      "render",        "fuse",    "metrics"};
  stage.always = true;
  stage.run = [in](const pipeline::StageContext& context) -> Result<pipeline::StageOutput> {
    ORBITFUSE_ASSIGN(const report::Model model, report_content(context, in));
    ORBITFUSE_TRY(write_file_atomic(context.folder / "report.html", report::to_html(model)));
    pipeline::StageOutput output;
    output.metrics["brief"] = "report.html";
    return output;
  };
  return stage;
}

}  // namespace orbitfuse::stages
