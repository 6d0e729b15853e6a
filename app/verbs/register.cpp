// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/register.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "app/cli/option_pairs.hpp"
#include "app/cli/run_stages.hpp"
#include "app/cli/verb.hpp"
#include "app/stages/registration_json.hpp"
#include "core/formats/ply.hpp"

namespace orbitfuse::cli {
namespace {

struct RegisterArguments {
  StageFolders folders;
  std::string source, target;
};

constexpr const char* clouds = "--source and --target";

Result<PointCloud> read_cloud(Context& context, const std::string& file) {
  ORBITFUSE_ASSIGN(PointCloud cloud, read_ply(file));
  const auto nowhere = std::count_if(cloud.positions.begin(), cloud.positions.end(),
                                     [](const Eigen::Vector3d& p) { return !p.allFinite(); });
  if (nowhere > 0)
    context.console.warning(fmt::format("{}: {} of {} points have no position, and are left out",
                                        file, nowhere, cloud.size()));
  return cloud;
}

Status register_files(Context& context, const RegisterArguments& o) {
  for (const auto& [option, value] : {std::pair{"--source", &o.source}, {"--target", &o.target}})
    if (value->empty()) return fail(ErrorKind::usage, option, "not given", "name both clouds");
  ORBITFUSE_TRY(check_apart({{"session", !o.folders.session.empty(), clouds, true}}));
  ORBITFUSE_ASSIGN(const PointCloud source, read_cloud(context, o.source));
  ORBITFUSE_ASSIGN(const PointCloud target, read_cloud(context, o.target));
  RegistrationOptions options;
  options.seed = static_cast<std::uint32_t>(context.common.seed);
  ORBITFUSE_ASSIGN(
      const RegistrationReport report,
      register_clouds(source, target, options, context.progress).map_error([&](Error error) {
        if (error.where == "source cloud") error.where = o.source;
        if (error.where == "target cloud") error.where = o.target;
        return error;
      }));
  for (const auto& fact : stages::facts(report))
    context.console.data(
        fmt::format("{:<22} {}", fact[0].get<std::string>(), fact[1].get<std::string>()));
  if (report.ambiguous) context.console.warning("ambiguous: " + report.ambiguity);
  context.result = stages::to_json(report);
  return {};
}

}  // namespace

Action add_register(CLI::App& app) {
  const auto options = std::make_shared<RegisterArguments>();
  add_folders(app, options->folders);
  app.add_option("--source", options->source, "PLY cloud to move; then --target too");
  app.add_option("--target", options->target, "PLY cloud to move it onto");
  return [options, &app](Context& context) -> Status {
    if (options->source.empty() && options->target.empty())
      return run_stages(context, options->folders, {"register"});
    ORBITFUSE_TRY(check_unused(app, {"--out", "--force", "--resume", "--config", "--set"}, clouds));
    return register_files(context, *options);
  };
}

}  // namespace orbitfuse::cli
