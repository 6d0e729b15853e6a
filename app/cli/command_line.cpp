// SPDX-License-Identifier: BSD-3-Clause
#include "app/cli/command_line.hpp"

#include <algorithm>
#include <cassert>
#include <charconv>
#include <optional>

#include "app/config/settings.hpp"
#include "app/pipeline/runner.hpp"

namespace orbitfuse::cli {
namespace {

/// Help that begins with a command to copy.
class ExampleFirst : public CLI::Formatter {
 public:
  std::string make_description(const CLI::App* app) const override {
    const std::string example = app->get_footer();
    return (example.empty() ? "" : "Example:\n  " + example + "\n\n") +
           Formatter::make_description(app);
  }
  std::string make_footer(const CLI::App* app) const override {
    if (app->get_parent() != nullptr) return {};
    return "\norbitfuse help VERB tells a verb's options.\n";
  }
};

constexpr const char* common_group = "Common";

void add_config(CLI::App& app, CommonOptions& common) {
  app.add_option("--config", common.config_file, "TOML file; config/orbitfuse.toml lists all keys")
      ->group(common_group);
  app.add_option("--set", common.overrides, "Override one key, e.g. render.views=12; repeatable")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false)
      ->group(common_group);
  app.add_flag("--print-config", common.print_config, "Print the resolved configuration and stop")
      ->group(common_group);
}

void add_seed(CLI::App& app, CommonOptions& common) {
  app.add_option("--seed", common.seed, "Seed of everything random")
      ->check([](const std::string& word) {
        std::uint32_t seed = 0;  // the most that all methods take
        const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), seed);
        return error == std::errc() && end == word.data() + word.size()
                   ? std::string()
                   : "'" + word + "' is no whole number from 0 to 2^32 - 1";
      })
      ->type_name("UINT")
      ->capture_default_str()
      ->group(common_group);
}

void add_common(CLI::App& app, CommonOptions& common, const CommonUse& use) {
  if (use.config) add_config(app, common);
  app.add_flag("--json", common.json, "NDJSON events on stdout, the last line a result")
      ->group(common_group);
  CLI::Option* verbose = app.add_flag("-v,--verbose", common.verbosity, "More messages");
  verbose->group(common_group);
  app.add_flag("-q,--quiet", common.quiet, "Errors only")->excludes(verbose)->group(common_group);
  app.add_option("--threads", common.threads, "Worker threads; 0 = all cores")
      ->check(CLI::Range(0, 1024))
      ->group(common_group);
  if (use.seed) add_seed(app, common);
  app.add_option("--device", common.device, "Where to compute")
      ->check(CLI::IsMember({"cpu", "cuda"}))
      ->capture_default_str()
      ->group(common_group);
  app.add_option("--trace", common.trace_file,
                 "Write where the time goes, in Chrome's trace format (chrome://tracing, Perfetto)")
      ->type_name("FILE")
      ->group(common_group);
  if (use.force)
    app.add_flag("--force", common.force,
                 use.resume ? "Run again although nothing changed; results of another session in "
                              "--out are removed"
                            : "Write over a file that is there")
        ->group(common_group);
  if (use.resume)
    app.add_flag("--resume", common.resume, "Go on where an interrupted run stopped")
        ->group(common_group);
  app.add_flag("--dry-run", common.dry_run, "Say what would be done, write nothing")
      ->group(common_group);
}

/// An option that other verbs have, and this one no use for.
std::optional<Error> unoffered(const CommandLine& line, const Verb& verb, const std::string& name) {
  for (const auto& [option, why, remedy] : verb.unoffered)
    if (name == option) return Error{ErrorKind::usage, name, why, remedy};
  for (const auto& [other, action] : line.actions) {
    const CLI::Option* option = line.app.get_subcommand(other->name)->get_option_no_throw(name);
    if (option != nullptr && option->get_group() == common_group)
      return Error{ErrorKind::usage, name, std::string("means nothing to ") + verb.name,
                   "leave it out"};
  }
  return std::nullopt;
}

/// The example of the verb's help that is shown first.
std::string example_of(const Verb& verb) {
  const std::string example = verb.example;
  return example.substr(0, example.find('\n'));
}

/// What CLI11 says in words of its own: a missing value or folder, a word that no option takes.
void tell_plainly(const CLI::App& app, const Verb& verb, const CLI::ParseError& error,
                  Error& result) {
  if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr &&
      app.get_option_no_throw("--visible") != nullptr) {
    result.remedy =
        "images are named by options: --visible and --thermal, e.g. " + example_of(verb);
    return;
  }
  if (dynamic_cast<const CLI::RequiredError*>(&error) != nullptr) {
    for (const CLI::Option* option : app.get_options()) {
      if (!option->get_positional() || !option->get_required() || option->count() > 0) continue;
      result.where = option->get_name(true);
      result.found = "not given: " + option->get_description();
      result.remedy = "write it without an option before it, e.g. " + example_of(verb);
      return;
    }
  }
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr) {
    const std::string option = result.found.substr(0, result.found.find(':'));
    const CLI::Option* known = app.get_option_no_throw(option);
    if (known == nullptr || known->count() > 0) return;
    result.where = option;
    result.found = "given without a value";
    result.remedy = "write " + option + " " + known->get_type_name();
  }
}

}  // namespace

CommandLine::CommandLine() : app("Radiance fields of two camera orbits, fused from any view") {
  app.name("orbitfuse");
  app.formatter(std::make_shared<ExampleFirst>());
  app.footer(verbs().front().example);
  app.set_version_flag("--version", "orbitfuse " + pipeline::software_version());
  app.require_subcommand(1);
  for (const Verb& verb : verbs()) {
    CLI::App* sub = app.add_subcommand(verb.name, verb.summary);
    sub->footer(verb.example);
    actions.emplace_back(&verb, verb.add(*sub));
    add_common(*sub, common, verb.common);
  }
}

const std::pair<const Verb*, Action>& CommandLine::chosen() const {
  const auto it = std::find_if(actions.begin(), actions.end(), [this](const auto& action) {
    return app.got_subcommand(action.first->name);
  });
  assert(it != actions.end());
  return *it;
}

Error usage_error(const CommandLine& line, const CLI::ParseError& error, int argc,
                  const char* const* argv) {
  std::vector<std::string> words, known;
  for (int i = 1; i < argc; ++i) words.emplace_back(argv[i]);
  const CLI::App* app = &line.app;
  const Verb* chosen = nullptr;
  for (const auto& [verb, action] : line.actions) {
    if (!words.empty() && words.front() == verb->name) chosen = verb;
    known.emplace_back(verb->name);
  }
  if (chosen) app = line.app.get_subcommand(chosen->name);
  Error result{ErrorKind::usage,
               {},
               error.what(),
               app == &line.app ? "orbitfuse --help lists the verbs"
                                : "orbitfuse " + app->get_name() + " --help lists the options"};
  std::replace(result.found.begin(), result.found.end(), '\n', ' ');
  const auto suggest = [&](const std::string& word, const std::vector<std::string>& names) {
    const std::string guess = config::nearest(word, names);
    if (!guess.empty()) result.remedy = "did you mean '" + guess + "'?";
  };
  if (app == &line.app) {
    if (!words.empty() && !words.front().starts_with('-')) {
      result.found = "unknown verb '" + words.front() + "'";
      suggest(words.front(), known);
    }
    return result;
  }
  tell_plainly(*app, *chosen, error, result);
  known.clear();
  for (const CLI::Option* option : app->get_options())
    for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
  for (const std::string& word : words) {
    const std::string name = word.substr(0, word.find('='));
    if (name.starts_with("--") && std::find(known.begin(), known.end(), name) == known.end()) {
      if (const auto refused = unoffered(line, *chosen, name)) return *refused;
      result.where.clear();
      result.found = "unknown option '" + name + "'";
      result.remedy = "orbitfuse " + app->get_name() + " --help lists the options";
      suggest(name, known);
      break;
    }
  }
  return result;
}

}  // namespace orbitfuse::cli
