// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/view_server.hpp"

#include <chrono>
#include <thread>

#include "app/cli/run_stages.hpp"
#include "app/cli/typed_options.hpp"
#include "app/cli/verb.hpp"
#include "app/export/viewer_surface.hpp"

namespace orbitfuse::cli {
namespace {

struct ViewArguments {
  std::string run, page = "8471", token;
};

/// Serves until Ctrl-C, which is how a viewer ends: no error.
Status view_run(Context& context, const ViewArguments& o) {
  ORBITFUSE_ASSIGN(const PageOptions page,
                   page_options_of("--page", o.page, o.token).map_error(as_typed_page));
  auto loaded = view::load_finished_run(o.run, context.config, context.progress);
  if (!loaded && loaded.error().kind == ErrorKind::cancelled) return {};
  ORBITFUSE_ASSIGN(view::FinishedRun run, std::move(loaded));
  for (const std::string& note : run.notes) context.console.warning(note);
  context.result = {{"run", o.run}, {"views", run.views.size()}, {"points", run.surface.size()}};
  view::ViewServer server(std::move(run), page,
                          context.common.dry_run ? view::MeshMaker() : exporting::viewer_surface);
  ORBITFUSE_TRY(server.start());
  if (context.common.dry_run) {
    context.console.info("the run can be shown, and the port is free");
    return {};
  }
  const std::vector<std::string> urls = server.urls();
  for (const std::string& url : urls) context.console.info("view: " + url);
  context.console.info("Ctrl-C ends it");
  context.console.event({{"event", "page"}, {"url", urls.front()}});
  while (!context.progress.cancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  server.stop();
  return {};
}

}  // namespace

Action add_view(CLI::App& app) {
  const auto options = std::make_shared<ViewArguments>();
  app.add_option("run", options->run, "The --out folder of a finished run")->required();
  app.add_option("--page", options->page,
                 "Serve the viewer at PORT or HOST:PORT; beyond this machine it needs a token")
      ->capture_default_str();
  app.add_option("--token", options->token, "Token of the page instead of a random one");
  return [options](Context& context) { return view_run(context, *options); };
}

}  // namespace orbitfuse::cli
