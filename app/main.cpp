// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <glog/logging.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <functional>
#include <iostream>
#include <new>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "app/cli/command_line.hpp"
#include "app/cli/run_stages.hpp"
#include "app/pipeline/out_folder.hpp"
#include "app/terminal/exit_code.hpp"
#include "app/terminal/interrupt.hpp"
#include "core/system/file_io.hpp"
#include "core/system/isa_wish.hpp"
#include "core/system/memory.hpp"
#include "core/system/parallel.hpp"
#include "core/system/trace.hpp"
#include "recon/nerf/compute_device.hpp"

// Where errors become exit codes, by the map of terminal/exit_code.hpp (docs/cli.md).
namespace orbitfuse {
namespace {

using namespace terminal;

void set_up_logging(int verbosity) {
  spdlog::set_default_logger(spdlog::stderr_logger_mt("orbitfuse"));
  spdlog::set_pattern("%v");
  spdlog::set_level(verbosity > 0   ? spdlog::level::debug
                    : verbosity < 0 ? spdlog::level::err
                                    : spdlog::level::warn);
}

/// Defaults, then the options of the run whose folder is given, then the file, then --set.
Status resolve_config(const CLI::App& verb, cli::Context& context) {
  const cli::CommonOptions& common = context.common;
  stages::RunConfig& config = context.config;
  config::Settings settings = config.settings();
  const CLI::Option* session = verb.get_option_no_throw("session");
  if (session == nullptr) session = verb.get_option_no_throw("run");
  std::optional<std::uint64_t> seed;
  if (session != nullptr && session->count() > 0) {
    ORBITFUSE_ASSIGN(seed, cli::read_earlier_options(session->as<std::string>(), settings));
  }
  if (!common.config_file.empty()) ORBITFUSE_TRY(settings.read_toml(common.config_file));
  for (const std::string& assignment : common.overrides) ORBITFUSE_TRY(settings.apply(assignment));
  context.given = settings.given();
  const CLI::Option* seed_option = verb.get_option_no_throw("--seed");
  const bool seed_given = seed_option != nullptr && seed_option->count() > 0;
  config.set_seed(seed_given ? common.seed : seed.value_or(common.seed));
  return config.validate();
}

/// Not for a farm: its jobs run elsewhere, and what this machine has says nothing of theirs.
void choose_device(const cli::CommonOptions& common, const cli::Verb& verb, Console& console) {
  if (common.device != "cuda" || !verb.common.fields || common.dry_run) return;
  const auto name = nerf::use_cuda();
  if (name)
    console.info(fmt::format("fields are computed on {}", *name));
  else
    console.warning(fmt::format("--device cuda: {}; the processor computes", name.error().found));
}

int finish(const std::string& verb, Console& console, const Status& status, nlohmann::json body) {
  const int code = status ? exit_ok : exit_code(status.error().kind);
  if (!status) console.error(status.error());
  body["ok"] = status.has_value();
  body["exit_code"] = code;
  if (!status)
    body["error"] = {{"where", status.error().where},
                     {"found", status.error().found},
                     {"remedy", status.error().remedy},
                     {"message", status.error().message()}};
  console.result(verb, std::move(body));
  const Status output = console.output_status();
  if (!status || output) return code;
  console.error(output.error());
  return exit_code(output.error().kind);
}

/// --help and --version, which CLI11 prints.
int finish_printing() {
  std::cout.flush();
  if (std::cout.good()) return exit_ok;
  std::fputs("error: standard output: cannot be written\n", stderr);
  return exit_device;
}

/// An empty value is a variable of a script that was not set: never the same as no option at all.
Status check_no_empty_values(const CLI::App& verb) {
  for (const CLI::Option* option : verb.get_options()) {
    const auto& values = option->results();
    if (option->get_expected_max() == 0 ||
        std::find(values.begin(), values.end(), "") == values.end())
      continue;
    return fail(ErrorKind::usage, option->get_name(), "empty", "give a value, or leave it out");
  }
  return {};
}

/// The action, its spans kept if a file was named for them. A folder that isn't there is seen
/// before the hours it is to tell of; it is not made, for it may be the one that the verb makes.
Status traced(const std::string& file, const char* verb, const std::function<Status()>& action) {
  if (file.empty()) return action();
  const std::filesystem::path folder = std::filesystem::absolute(file).parent_path();
  std::error_code unreadable;
  if (!std::filesystem::is_directory(folder, unreadable) || ::access(folder.c_str(), W_OK) != 0 ||
      std::filesystem::is_directory(file, unreadable))
    return fail(ErrorKind::usage, "--trace " + file, "no file in a folder that can be written to",
                "name a file in a folder that exists");
  ORBITFUSE_TRY(pipeline::check_outside_stages(file));
  start_trace();
  Status status;
  {
    const TraceSpan span(verb);
    status = action();
  }
  const Status written = write_file_atomic(file, trace_json());
  return status ? written : status;
}

/// "help [VERB]" means "[VERB] --help".
std::vector<const char*> words_of(int argc, char** argv) {
  std::vector<const char*> words(argv, argv + argc);
  if (argc < 2 || std::strcmp(words[1], "help") != 0) return words;
  words.erase(words.begin() + 1);
  words.push_back("--help");
  return words;
}

int run(const std::vector<const char*>& words) {
  const auto argc = static_cast<int>(words.size());
  const char* const* argv = words.data();
  cli::CommandLine line;
  try {
    line.app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const bool unknown_verb =
        argc > 1 && argv[1][0] != '-' &&
        std::none_of(line.actions.begin(), line.actions.end(), [&](const auto& action) {
          return std::strcmp(action.first->name, argv[1]) == 0;
        });
    if (dynamic_cast<const CLI::Success*>(&error) != nullptr && !unknown_verb)  // --help, --version
      return line.app.exit(error) == 0 ? finish_printing() : exit_internal;
    ConsoleOptions options = detect_terminal();
    for (int i = 1; i < argc; ++i)
      options.json = options.json || std::strcmp(argv[i], "--json") == 0;
    Console console(options);
    return finish(argc > 1 ? argv[1] : "", console,
                  tl::unexpected(cli::usage_error(line, error, argc, argv)), {});
  }

  ConsoleOptions options = detect_terminal();
  options.json = line.common.json;
  options.verbosity = line.common.quiet ? -1 : line.common.verbosity;
  Console console(options);
  set_up_logging(options.verbosity);
  install_interrupt_handler();
  set_thread_count(line.common.threads);
  keep_freed_memory();

  const cli::Verb* verb = line.chosen().first;
  const cli::Action& action = line.chosen().second;
  stages::RunConfig config;
  cli::Context context{line.common, config, console, {}, {}, {}};
  context.progress.report = [&console](const ProgressEvent& event) { console.progress(event); };
  context.progress.cancel = &interrupt_flag();

  const CLI::App& given = *line.app.get_subcommand(verb->name);
  Status status = check_no_empty_values(given);
  if (status) status = check_isa_wish();
  if (status) status = resolve_config(given, context);
  if (status && line.common.print_config) {
    console.data(config.settings().to_toml());
    context.result = {{"config", config.settings().to_json()}};
  } else if (status) {
    const std::string no_file;
    choose_device(line.common, *verb, console);
    status = traced(line.common.dry_run ? no_file : line.common.trace_file, verb->name,
                    [&] { return action(context); });
  }
  return finish(verb->name, console, status, std::move(context.result));
}

}  // namespace
}  // namespace orbitfuse

/// OpenCV asks the environment how to use FFmpeg. Before any thread: setenv races with every
/// getenv.
static void set_up_ffmpeg() {
  // Lossy transports tear pictures.
  ::setenv("OPENCV_FFMPEG_CAPTURE_OPTIONS", "rtsp_transport;tcp|analyzeduration;1000000", 0);
  // Its remarks on damaged packets belong to no terminal; what matters of them is counted.
  ::setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);
}

/// OpenCV has an exception of its own for it.
static bool is_out_of_memory(const std::exception& error) {
  const auto* of_opencv = dynamic_cast<const cv::Exception*>(&error);
  return dynamic_cast<const std::bad_alloc*>(&error) != nullptr ||
         (of_opencv != nullptr && of_opencv->code == cv::Error::StsNoMem);
}

int main(int argc, char** argv) {
  set_up_ffmpeg();
  // Ceres' remarks belong to no terminal either: what its callers can't use, they say themselves.
  FLAGS_minloglevel = google::GLOG_FATAL;
  // A file that outgrows `ulimit -f` is a disk that takes no more, told like one.
  std::signal(SIGXFSZ, SIG_IGN);
  int code = orbitfuse::terminal::exit_internal;
  try {
    code = orbitfuse::run(orbitfuse::words_of(argc, argv));
  } catch (const std::exception& error) {
    if (is_out_of_memory(error)) {
      std::fputs(
          "error: memory: no more is to be had; free some or raise the limit (ulimit -v, the job's "
          "memory), or ask for smaller images and fewer --threads\n",
          stderr);
      code = orbitfuse::terminal::exit_device;
    } else {
      std::fprintf(stderr, "internal error: %s; please report it with the command line\n",
                   error.what());
    }
  } catch (...) {
    std::fputs("internal error; please report it with the command line\n", stderr);
  }
  // Everything is on disk by now. Exit handlers of camera libraries would wait for a camera that is
  // gone, and race with the thread that still closes its connection.
  std::cout.flush();
  std::fflush(nullptr);
  std::_Exit(code);
}
