// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "app/cli/run_stages.hpp"
#include "app/cli/verb.hpp"
#include "app/comparison/comparison_files.hpp"

namespace orbitfuse::cli {
namespace {
namespace fs = std::filesystem;
using namespace comparison;

struct Options {
  std::string before, after, out;
  bool ambient = false;
  double least_k = CompareOptions().least_k;
};

/// A folder that holds something else is never written into.
Status check_folder(const fs::path& out) {
  std::error_code error;
  if (!fs::exists(out, error)) return {};
  if (!fs::is_directory(out, error))
    return fail(ErrorKind::input, "--out " + out.string(), "a file", "name a new folder");
  if (!fs::is_empty(out, error) && !fs::exists(out / "differences.json", error))
    return fail(ErrorKind::input, "--out " + out.string(),
                "a folder that holds something else than a comparison", "name a new folder");
  return {};
}

Result<view::FinishedRun> loaded(const std::string& folder, Context& context) {
  ORBITFUSE_ASSIGN(view::FinishedRun run,
                   view::load_finished_run(folder, context.config, context.progress));
  for (const std::string& note : run.notes) context.console.warning(folder + ": " + note);
  return run;
}

void tell(Context& context, const Comparison& c) {
  context.console.info(fmt::format(
      "{:.0f} % of the surface compared, {:.1f} % changed in form, {:.0f} % not seen by both; "
      "common difference {:+.2f} K{}, noise {:.2f} K",
      100 * c.same_share, 100 * c.changed_share, 100 * c.unseen_share, c.ambient_k,
      c.ambient_removed ? " (taken out)" : "", c.noise_k));
  for (const ComparedRegion& r : c.warmer_or_colder)
    context.console.data(fmt::format("{:+.2f} +- {:.2f} K (peak {:+.2f}) at {:.3f},{:.3f},{:.3f}",
                                     r.mean_k, r.uncertainty_k, r.peak_k, r.center.x(),
                                     r.center.y(), r.center.z()));
  for (const auto& [words, regions] :
       {std::pair("appeared", &c.appeared), std::pair("gone", &c.gone)})
    for (const ComparedRegion& r : *regions)
      context.console.data(fmt::format("surface {} at {:.3f},{:.3f},{:.3f}", words, r.center.x(),
                                       r.center.y(), r.center.z()));
}

Status compare(Context& context, const Options& o) {
  CompareOptions options;
  options.without_ambient = o.ambient;
  options.least_k = o.least_k;
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_TRY(check_folder(o.out));
  std::error_code error;
  if (fs::equivalent(o.before, o.after, error))
    return fail(ErrorKind::usage, o.after, "the same run twice", "name an earlier and a later run");
  ORBITFUSE_ASSIGN(const view::FinishedRun before, loaded(o.before, context));
  ORBITFUSE_ASSIGN(const view::FinishedRun after, loaded(o.after, context));
  ORBITFUSE_ASSIGN(const std::string world, stages::world_identity(o.after));
  ORBITFUSE_ASSIGN(const auto scale, stages::load_metric_scale(o.after, world));
  if (context.common.dry_run) {
    context.console.info("the runs can be compared");
    return {};
  }
  ORBITFUSE_ASSIGN(const Comparison found,
                   compare_runs(before, after, options, context.progress));
  const ComparedRuns runs{before, after, scale, found};
  ORBITFUSE_TRY(write_comparison(o.out, runs, options, context.progress));
  context.result = to_json(runs);
  tell(context, found);
  context.console.data((fs::path(o.out) / "comparison.html").string());
  return {};
}

}  // namespace

Action add_compare(CLI::App& app) {
  const auto o = std::make_shared<Options>();
  app.add_option("before", o->before, "The --out folder of the earlier run")->required();
  app.add_option("after", o->after, "The --out folder of the later run, of the same object")
      ->required();
  app.add_option("--out", o->out, "Folder for the comparison: new, or of an earlier one")
      ->required();
  app.add_flag("--ambient", o->ambient,
               "Take out what the whole unchanged surface differs by: another air temperature");
  app.add_option("--least-k", o->least_k, "Smallest difference worth a line, kelvin")
      ->capture_default_str();
  return [o](Context& context) { return compare(context, *o); };
}

}  // namespace orbitfuse::cli
