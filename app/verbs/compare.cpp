// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "app/cli/run_folder.hpp"
#include "app/cli/typed_options.hpp"
#include "app/cli/verb.hpp"
#include "app/comparison/comparison_files.hpp"
#include "app/pipeline/out_folder.hpp"
#include "app/pipeline/stage_record.hpp"

namespace orbitfuse::cli {
namespace {
namespace fs = std::filesystem;
using namespace comparing;

struct CompareArguments {
  std::string before, after, out;
  bool ambient = false;
  int triangles = CompareRequest().triangles;
};

void tell(Context& context, const CompareArguments& o, const ComparedRuns& runs) {
  context.console.info(
      fmt::format("registered: unchanged surfaces lie {} apart", residual_words(runs)));
  if (runs.registration.clouds.ambiguous)
    context.console.warning("geometry leaves several placements: " +
                            runs.registration.clouds.ambiguity);
  if (!runs.scale_doubt.empty()) context.console.warning(runs.scale_doubt);
  context.console.info(ambient_words(runs));
  int number = 0;
  for (const auto& region : runs.differences)
    context.console.data(fmt::format("{:>3} {:+.2f} +- {:.2f} K, {}", ++number, region.difference_k,
                                     region.uncertainty_k, area_words(runs, region.area)));
  context.console.info(
      fmt::format("{:.1f} % of the surface compared, {:.1f} % changed geometry, {:.1f} % not seen "
                  "before, {:.1f} "
                  "% without a temperature in both; {} parts came, {} are gone",
                  100 * runs.shares.compared, 100 * runs.shares.changed, 100 * runs.shares.not_seen,
                  100 * runs.shares.without_temperature, runs.came.size(), runs.gone.size()));
  context.console.info((fs::path(o.out) / "compare.html").string());
}

/// Two runs of one session differ by what the program did, not by what the object did.
bool are_of_one_session(const std::string& before, const std::string& after) {
  const auto id = [](const std::string& run) {
    const nlohmann::json told = earlier_run(run).value_or(nlohmann::json());
    return told.is_object() ? told.value("session_id", nlohmann::json()) : nlohmann::json();
  };
  return id(before).is_string() && id(before) == id(after);
}

Status run(Context& context, const CompareArguments& o) {
  ORBITFUSE_TRY(check_typed({{"--triangles", o.triangles, from_to(4, 20'000'000)}}));
  CompareRequest request;
  request.ambient = o.ambient;
  request.triangles = o.triangles;
  std::error_code unreadable;
  if (fs::equivalent(o.before, o.after, unreadable))
    return fail(ErrorKind::usage, o.after, "the two runs are the same",
                "name the --out folders of two runs of the object, the earlier one first");
  for (const std::string& run : {o.before, o.after})
    if (fs::equivalent(run, o.out, unreadable))
      return fail(ErrorKind::usage, "--out", "'" + o.out + "', which is one of the runs",
                  "name a new folder");
  for (const std::string& run : {o.before, o.after})
    if (pipeline::lies_in_a_stage(run, o.out))
      return fail(ErrorKind::usage, "--out", "'" + o.out + "', inside of a stage of " + run,
                  "name a new folder");
  ORBITFUSE_TRY(pipeline::check_out_folder(o.out));
  if (are_of_one_session(o.before, o.after))
    context.console.warning(
        "both runs are of one session: what differs is what two runs of the same frames differ by, "
        "no change of the object");
  if (context.common.dry_run) {
    ORBITFUSE_TRY(check_comparable(o.before, o.after, context.config, request, context.progress));
    context.console.info(
        "both runs hold what a comparison needs; whether they show one object is seen when their "
        "surfaces are brought together");
    return {};
  }
  ORBITFUSE_ASSIGN(const ComparedRuns runs,
                   compare_runs(o.before, o.after, context.config, request, context.progress));
  context.result["comparison"] = to_json(runs);
  ORBITFUSE_ASSIGN(const auto pictures, pictures_of(runs, context.progress));
  ORBITFUSE_TRY(write_comparison(o.out, runs, pictures));
  tell(context, o, runs);
  return {};
}

}  // namespace

Action add_compare(CLI::App& app) {
  const auto o = std::make_shared<CompareArguments>();
  app.add_option("before", o->before, "The --out folder of the earlier run")->required();
  app.add_option("after", o->after, "The --out folder of the later run, of the same object")
      ->required();
  app.add_option("--out", o->out, "Folder for the page, files and pictures")->required();
  app.add_flag("--ambient", o->ambient,
               "Take out what both days differ by as a whole: the median difference over the "
               "unchanged surface");
  app.add_option("--triangles", o->triangles, "Most triangles of each surface")
      ->capture_default_str();
  return [o](Context& context) { return run(context, *o); };
}

}  // namespace orbitfuse::cli
