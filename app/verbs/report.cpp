// SPDX-License-Identifier: BSD-3-Clause
#include "app/cli/run_stages.hpp"
#include "app/cli/verb.hpp"

namespace orbitfuse::cli {

Action add_report(CLI::App& app) {
  const auto folders = std::make_shared<StageFolders>();
  add_folders(app, *folders);
  return [folders](Context& context) {
    return run_stages(context, *folders, {"report"}, Missing::leave_out);
  };
}

}  // namespace orbitfuse::cli
