// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/report/report_model.hpp"
#include "app/stages/stage_list.hpp"

namespace orbitfuse::stages {

/// What the finished stages have to show, gathered for the report.
Result<report::Model> report_content(const pipeline::StageContext& context, const StageInputs& in);

}  // namespace orbitfuse::stages
