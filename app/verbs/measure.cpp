// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "app/cli/run_stages.hpp"
#include "app/cli/verb.hpp"
#include "app/stages/measurement_scene.hpp"
#include "app/verbs/measure_options.hpp"
#include "core/temperature.hpp"
#include "recon/measurement/measure.hpp"
#include "recon/measurement/reradiometry.hpp"
#include "recon/measurement/table.hpp"

namespace orbitfuse::cli {
namespace {
namespace fs = std::filesystem;
using namespace measurement;
using nlohmann::json;

struct MeasureArguments {
  std::string out, session;
  MeasureWords words;
};

/// The session that a run's folder names, or the one that was given.
Result<Session> session_of(const MeasureArguments& options) {
  std::error_code unreadable;
  if (!fs::is_directory(options.out, unreadable))
    return fail(ErrorKind::input, options.out, "no such folder", "name the --out folder of a run");
  if (!fs::exists(fs::path(options.out) / "run.json", unreadable) && unreadable)
    return fail(ErrorKind::input, options.out, unreadable.message(), "check its permissions");
  StageFolders folders{options.out, options.out};
  if (!options.session.empty()) folders.session = options.session;
  if (options.session.empty()) {
    if (!fs::exists(fs::path(options.out) / "run.json", unreadable))
      return fail(ErrorKind::input, options.out, "no run.json in it",
                  "name the --out folder of a run, or give --session too");
    ORBITFUSE_TRY(resolve(folders).map_error([&](Error error) {
      std::error_code gone;
      if (folders.session != options.out && !fs::exists(folders.session, gone))
        error.remedy = "bring it back, or say where it is now: --session FOLDER";
      return error;
    }));
  }
  return open_session(folders.session).map_error([](Error error) {
    error.remedy += "; or say where the session is with --session";
    return error;
  });
}

std::string brief(const SavedMeasurement& saved) {
  const json& a = saved.answer;
  const auto value = [](const json& j, const char* key) {
    return j.is_object() && j.contains(key) && j[key].is_number()
               ? std::optional(j[key].get<double>())
               : std::nullopt;
  };
  std::string text = fmt::format("{:<20} {:<10}", saved.name, name(saved.request.kind));
  if (const auto k = value(a.value("reading", json()), "temperature_k"))
    text += fmt::format(" {:.2f} C", celsius_from_kelvin(*k));
  if (const auto k = value(a, "difference_k")) text += fmt::format(" {:+.2f} K", *k);
  if (const auto d = value(a, "distance")) text += fmt::format(" {:.4f} units", *d);
  return text + "  " + saved.created;
}

/// Without a question: what was saved.
void list(Context& context, const Measurements& saved, const std::string& file) {
  context.result["measurements"] = json::array();
  for (const SavedMeasurement& m : saved.list) {
    context.console.data(brief(m));
    context.result["measurements"].push_back(to_json(m));
  }
  if (saved.list.empty())
    context.console.info("no saved measurements in " + file +
                         "; ask for one, e.g. --hottest 3 (--help lists the kinds)");
}

void tell(Context& context, const MeasureArguments& options, const std::string& name,
          const Answer& answer) {
  if (options.words.csv) {
    context.console.data(csv_header());
    for (const std::string& row : csv_rows(name, answer)) context.console.data(row);
    for (const std::string& note : answer.notes) context.console.info("note: " + note);
    return;
  }
  for (const std::string& line : described(answer)) context.console.data(line);
  if (answer.kind != Kind::distance) context.console.info(std::string("+- ") + uncertainty_words);
}

/// A slip in the name would show in the report, when nobody can ask again.
Status check_reference(const std::string& name, const Measurements& saved,
                       const std::string& file) {
  if (name.empty() || saved.find(name) != nullptr) return {};
  std::vector<std::string> names;
  for (const SavedMeasurement& m : saved.list) names.push_back("'" + m.name + "'");
  return fail(ErrorKind::usage, "--reference", fmt::format("'{}', which is not in {}", name, file),
              names.empty() ? "save that measurement first: none is saved"
                            : fmt::format("name one of {}", fmt::join(names, ", ")));
}

/// The library asks for what the camera was set to; here that is an option.
Error without_recorded(Error error) {
  if (error.where == recorded_unknown)
    error.remedy =
        "say what the camera was set to: --recorded-emissivity, and --recorded-reflected-c if it "
        "was not 20 C; or import the camera's radiometric JPEGs";
  return error;
}

Result<Anchored> ask(const ThermalScene& scene, const Request& request, bool to_keep,
                     const Progress& progress) {
  if (to_keep) return measure_anchored(scene, request, progress).map_error(without_recorded);
  ORBITFUSE_ASSIGN(Answer answer, measure(scene, request, progress).map_error(without_recorded));
  return Anchored{request, std::move(answer)};
}

Status run(Context& context, const MeasureArguments& options) {
  if (options.words.csv && context.common.json)
    return fail(ErrorKind::usage, "--csv", "together with --json", "choose one of them");
  const MeasureWords& words = options.words;
  ORBITFUSE_TRY(check_pairs(words));
  if (!words.name.empty() && words.name == words.reference)
    return fail(ErrorKind::usage, "--reference", "'" + words.reference + "', its own name",
                "name another saved measurement");
  ORBITFUSE_ASSIGN(const Session session, session_of(options));
  ORBITFUSE_ASSIGN(const ThermalScene scene, stages::load_measurement_scene(options.out, session));
  const fs::path file = fs::path(options.out) / measurements_file;
  // Others' measurements stand in the way of names and of saving, not of looking.
  const auto saved = load_measurements(file, scene.identity());
  if (!saved && options.words.save) return tl::unexpected(saved.error());
  if (!saved) context.console.warning(saved.error().message());
  Measurements known = saved.value_or(Measurements{});
  bring_to_scale(known, scene.metres_per_unit(), scene.scale_relative_sigma());
  for (const std::string& note : known.notes) context.console.warning(note);
  ORBITFUSE_TRY(check_reference(words.reference, known, file.string()));
  ORBITFUSE_ASSIGN(const auto request, request_of(options.words, scene, known));
  if (!request) {
    if (!saved) return tl::unexpected(saved.error());
    if (options.words.csv)
      return fail(ErrorKind::usage, "--csv", "nothing to measure beside it",
                  "ask for a --point, --pixel, --box ... ; saved ones: --json");
    list(context, known, file.string());
    return {};
  }
  if (words.save) ORBITFUSE_TRY(check_name(request->name));  // before it takes its time
  ORBITFUSE_ASSIGN(const Anchored measured, ask(scene, *request, words.save, context.progress));
  const Answer& answer = measured.answer;
  std::string name = request->name;
  if (options.words.save && context.common.dry_run) {
    context.console.info("would be saved in " + file.string());
  } else if (options.words.save) {
    ORBITFUSE_ASSIGN(const Kept kept,
                     add_measurement(file, scene.identity(),
                                     {name, "", measured.request, to_json(answer), words.remark,
                                      words.component, words.reference}));
    name = kept.name;
    context.console.info(fmt::format("saved as '{}' in {}{}", name, file.string(),
                                     kept.replaced ? ", in place of the one of that name" : ""));
    if (!kept.words.empty()) context.console.info("of the one before: " + kept.words);
    context.result["replaced"] = kept.replaced;
    context.result["earlier_words"] = kept.words;
  }
  if (name.empty()) name = std::string(measurement::name(request->kind));
  context.result["name"] = name;
  context.result["request"] = to_json(*request);
  context.result["answer"] = to_json(answer);
  tell(context, options, name, answer);
  return {};
}

}  // namespace

Action add_measure(CLI::App& app) {
  const auto options = std::make_shared<MeasureArguments>();
  app.add_option("out", options->out, "The --out folder of a finished run")->required();
  app.add_option("--session", options->session, "Where the session is, if it was moved");
  add_measure_options(app, options->words);
  return [options](Context& context) { return run(context, *options); };
}

}  // namespace orbitfuse::cli
