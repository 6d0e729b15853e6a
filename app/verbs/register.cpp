// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/register.hpp"

#include <fmt/format.h>

#include "app/cli/run_stages.hpp"
#include "app/cli/verb.hpp"
#include "app/stages/registration_json.hpp"
#include "core/formats/ply.hpp"

namespace orbitfuse::cli {
namespace {

struct Options {
  StageFolders folders;
  std::string source, target;
};

Status register_files(Context& context, const Options& o) {
  for (const auto& [option, value] : {std::pair{"--source", &o.source}, {"--target", &o.target}})
    if (value->empty()) return fail(ErrorKind::usage, option, "not given", "name both clouds");
  ORBITFUSE_ASSIGN(const PointCloud source, read_ply(o.source));
  ORBITFUSE_ASSIGN(const PointCloud target, read_ply(o.target));
  RegistrationOptions options;
  options.seed = static_cast<std::uint32_t>(context.common.seed);
  ORBITFUSE_ASSIGN(const RegistrationReport report,
                   register_clouds(source, target, options, context.progress));
  for (const auto& fact : stages::facts(report))
    context.console.data(
        fmt::format("{:<22} {}", fact[0].get<std::string>(), fact[1].get<std::string>()));
  if (report.ambiguous) context.console.warning("ambiguous: " + report.ambiguity);
  context.result = stages::to_json(report);
  return {};
}

}  // namespace

Action add_register(CLI::App& app) {
  const auto options = std::make_shared<Options>();
  add_folders(app, options->folders);
  app.add_option("--source", options->source, "PLY cloud to move; then --target too");
  app.add_option("--target", options->target, "PLY cloud to move it onto");
  return [options](Context& context) {
    return options->source.empty() && options->target.empty()
               ? run_stages(context, options->folders, {"register"})
               : register_files(context, *options);
  };
}

}  // namespace orbitfuse::cli
