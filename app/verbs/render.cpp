// SPDX-License-Identifier: BSD-3-Clause
#include "app/cli/option_pairs.hpp"
#include "app/cli/run_stages.hpp"
#include "app/cli/typed_options.hpp"
#include "app/cli/verb.hpp"
#include "app/stages/given_cameras.hpp"

namespace orbitfuse::cli {
namespace {

struct RenderArguments {
  StageFolders folders;
  std::string cameras, path;
  std::optional<int> views, width;
};

}  // namespace

Action add_render(CLI::App& app) {
  const auto options = std::make_shared<RenderArguments>();
  add_folders(app, options->folders);
  app.add_option("--cameras", options->cameras,
                 "transforms.json with the views, in the visible frame; later verbs keep them "
                 "(--path: no more)");
  app.add_option("--path", options->path, "Where new cameras stand (render.path)")
      ->check(CLI::IsMember({"auto", "orbit", "path"}));
  app.add_option("--views", options->views, "New cameras (render.views)");
  app.add_option("--width", options->width, "Pixels (render.width_px)");
  return [options](Context& context) -> Status {
    const bool cameras = !options->cameras.empty();
    ORBITFUSE_TRY(check_apart({{"--path", !options->path.empty(), "--cameras", cameras},
                               {"--views", options->views.has_value(), "--cameras", cameras},
                               {"--width", options->width.has_value(), "--cameras", cameras}}));
    if (cameras) {
      // Read here once, so that a wrong file doesn't cost the training that comes before it.
      ORBITFUSE_TRY(stages::read_given_cameras(options->cameras));
      context.config.render.cameras = options->cameras;
    }
    config::Settings settings = context.config.settings();
    if (!options->path.empty()) ORBITFUSE_TRY(settings.apply("render.path=" + options->path));
    if (options->views) context.config.render.path.views = *options->views;
    if (options->width) context.config.render.path.width_px = *options->width;
    if (!options->path.empty() || options->views || options->width)
      context.given.insert("render.path");  // no longer an earlier call's --cameras
    ORBITFUSE_TRY(context.config.validate().map_error([&](Error error) {
      if (options->views) error = as_typed(error, {{"render.views", "--views"}});
      if (options->width) error = as_typed(error, {{"render.width_px", "--width"}});
      return error;
    }));
    return run_stages(context, options->folders, {"render"});
  };
}

}  // namespace orbitfuse::cli
