// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "app/cli/run_folder.hpp"
#include "app/cli/run_stages.hpp"
#include "app/cli/verb.hpp"
#include "app/eval/evaluate.hpp"
#include "app/stages/session_input.hpp"

namespace orbitfuse::cli {
namespace {
using nlohmann::json;

struct EvalArguments {
  StageFolders folders;
  std::string truth;
  eval::EvaluateOptions evaluate;
};

void print_poses(terminal::Console& console, const json& result, const char* key,
                 const char* label) {
  if (!result.contains(key)) return;
  const json& j = result[key];
  console.data(
      fmt::format("{:<22} {}/{} views, ATE {:.3f} % of the extent (max {:.3f}), rotation "
                  "{:.3f} deg mean, {:.3f} max",
                  label, j["posed"].get<int>(), j["total"].get<int>(),
                  j["ate_percent"].get<double>(), j["ate_max_percent"].get<double>(),
                  j["rotation_mean_deg"].get<double>(), j["rotation_max_deg"].get<double>()));
  if (j.contains("sure")) print_poses(console, j, "sure", "  without doubtful ones");
}

void print(terminal::Console& console, const json& result) {
  print_poses(console, result, "poses_visible", "visible poses");
  print_poses(console, result, "poses_thermal", "thermal poses");
  print_poses(console, result, "registration", "thermal, visible frame");
  print_poses(console, result, "registration_refined", "the same, as trained");
  if (const auto it = result.find("test_views"); it != result.end()) {
    if (it->contains("visible_psnr_db"))
      console.data(fmt::format("{:<22} {:.2f} dB on {} test views", "visible field",
                               it->at("visible_psnr_db").get<double>(),
                               it->at("views").get<int>()));
    if (it->contains("temperature_mae_c"))
      console.data(fmt::format("{:<22} MAE {:.3f} degC, {:.2f} dB, {:.0f} % of the scene covered",
                               "thermal field", it->at("temperature_mae_c").get<double>(),
                               it->at("thermal_psnr_db").get<double>(),
                               100 * it->at("thermal_covered").get<double>()));
  }
  if (const auto it = result.find("test_views"); it != result.end() && it->contains("gray_mae_c"))
    console.data(fmt::format(
        "{:<22} gray levels: rank correlation {:.3f} with the truth, off by "
        "{:.3f} degC where each stands for its usual temperature, {:.0f} % of the scene "
        "covered",
        "thermal field", it->at("gray_rank_correlation").get<double>(),
        it->at("gray_mae_c").get<double>(), 100 * it->at("thermal_covered").get<double>()));
  for (const json& warning : result["warnings"]) console.warning(warning.get<std::string>());
  for (const json& note : result["notes"]) console.info("note: " + note.get<std::string>());
}

Status run(Context& context, EvalArguments& o) {
  ORBITFUSE_TRY(resolve(o.folders));
  ORBITFUSE_ASSIGN(const Session session, open_session(o.folders.session));
  ORBITFUSE_ASSIGN(const GroundTruth truth, read_ground_truth(o.truth));
  std::error_code unreadable;
  if (!std::filesystem::is_directory(o.folders.out, unreadable))
    return fail(ErrorKind::input, o.folders.out, "no such folder", "run the session first");
  const auto other = other_results(o.folders.out, session, [&](Modality modality) {
    return stages::modality_content(session, modality).value_or(std::string());
  });
  if (other)
    context.console.warning(fmt::format("{} {}: frames are told by name", o.folders.out, *other));
  ORBITFUSE_ASSIGN(const json result,
                   eval::evaluate(o.folders.out, session, truth, o.evaluate, context.progress));
  if (!result.contains("poses_visible") && !result.contains("poses_thermal"))
    return fail(ErrorKind::input, o.truth,
                fmt::format("nothing could be compared: {}",
                            fmt::join(result["notes"].get<std::vector<std::string>>(), "; ")),
                "give the truth of this session, after its poses stage");
  print(context.console, result);
  context.result = result;
  return {};
}

}  // namespace

Action add_eval(CLI::App& app) {
  const auto options = std::make_shared<EvalArguments>();
  add_folders(app, options->folders);
  app.add_option("--ground-truth", options->truth, "Exact poses and test views (docs/formats.md)")
      ->required();
  app.add_option("--max-width", options->evaluate.max_width_px,
                 "Test views are compared at this width")
      ->check(CLI::Range(16, 8192))
      ->capture_default_str();
  return [options](Context& context) { return run(context, *options); };
}

}  // namespace orbitfuse::cli
