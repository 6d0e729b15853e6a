// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "app/cli/option_pairs.hpp"
#include "app/cli/run_stages.hpp"
#include "app/cli/verb.hpp"
#include "app/fusion_batch/fusion_batch.hpp"
#include "core/image/image_io.hpp"
#include "fusion/metrics/metrics.hpp"

namespace orbitfuse::cli {
namespace {

struct MetricsArguments {
  StageFolders folders;
  std::string visible, thermal, fused;
  bool on_files() const { return !visible.empty() || !thermal.empty() || !fused.empty(); }
};

constexpr const char* images = "--visible, --thermal and --fused";

Status score_files(Context& context, const MetricsArguments& o) {
  for (const auto& [option, value] :
       {std::pair{"--visible", &o.visible}, {"--thermal", &o.thermal}, {"--fused", &o.fused}})
    if (value->empty()) return fail(ErrorKind::usage, option, "not given", "name all three images");
  ORBITFUSE_TRY(check_apart({{"session", !o.folders.session.empty(), images, true}}));
  ORBITFUSE_ASSIGN(const cv::Mat visible, batch::read_photo(o.visible));
  std::error_code missing;
  if (std::filesystem::equivalent(o.visible, o.thermal, missing))
    return fail(ErrorKind::usage, "--thermal " + o.thermal, "is --visible too",
                "name the thermal one");
  // Radiometric files are scored as the gray image that fusion makes of them.
  ORBITFUSE_ASSIGN(const cv::Mat stored, batch::read_thermal(o.thermal));
  if (const auto remark = batch::looks_exchanged(visible, stored, o.visible))
    context.console.warning(*remark);
  if (const auto remark = batch::in_colors(stored, o.thermal)) context.console.warning(*remark);
  const auto named = [&](Error error) {
    return batch::with_file(std::move(error),
                            {{"visible", o.visible}, {"thermal", o.thermal}, {"fused", o.fused}});
  };
  ORBITFUSE_ASSIGN(const cv::Mat thermal, batch::gray_of_thermal(stored, {}).map_error(named));
  ORBITFUSE_ASSIGN(const cv::Mat fused, batch::read_photo(o.fused));
  ORBITFUSE_ASSIGN(const auto values, fusion_metrics(visible, thermal, fused).map_error(named));
  for (const std::string& file : {o.visible, o.thermal, o.fused})
    for (const std::string& remark : batch::unused_parts(file)) context.console.warning(remark);
  nlohmann::json metrics = nlohmann::json::object(), definitions = metrics;
  for (const MetricValue& v : values) {
    context.console.data(fmt::format("{:<10} {:>14.6f}  {}", v.name, v.value, v.definition));
    metrics[v.name] = v.value;
    definitions[v.name] = v.definition;
  }
  context.result = {{"metrics", metrics}, {"definitions", definitions}};
  return {};
}

}  // namespace

Action add_metrics(CLI::App& app) {
  const auto options = std::make_shared<MetricsArguments>();
  add_folders(app, options->folders);
  app.add_option("--visible", options->visible, "Visible image; then --thermal and --fused too");
  app.add_option("--thermal", options->thermal, "Thermal image of the same size");
  app.add_option("--fused", options->fused, "Fused image of the same size");
  return [options, &app](Context& context) -> Status {
    if (!options->on_files()) return run_stages(context, options->folders, {"metrics"});
    ORBITFUSE_TRY(
        check_unused(app, {"--out", "--force", "--resume", "--seed", "--config", "--set"}, images));
    return score_files(context, *options);
  };
}

}  // namespace orbitfuse::cli
