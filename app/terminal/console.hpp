// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>

#include "core/progress.hpp"
#include "core/result.hpp"

namespace orbitfuse::terminal {

/// Schema of the --json stream; raised when a field changes its meaning.
inline constexpr int json_schema = 1;

struct ConsoleOptions {
  bool json = false;      ///< NDJSON events on stdout instead of text
  int verbosity = 0;      ///< < 0: errors only; > 0: details
  bool terminal = false;  ///< stderr is one: draw bars
  bool color = false;
};

/// Data goes to stdout, messages and the bar to stderr. Safe to call from worker threads.
class Console {
 public:
  explicit Console(ConsoleOptions options) : options_(options) {}
  ~Console() { clear_bar(); }

  bool json() const { return options_.json; }
  /// What stopped the output: data that never arrived must not look like success. A reader that
  /// went away (head) has what it wanted.
  Status output_status() const;
  bool verbose() const { return options_.verbosity > 0; }
  /// Whether a person sees how far the work is.
  bool draws_bars() const { return options_.terminal && !options_.json; }
  void info(const std::string& message);
  void detail(const std::string& message);  ///< with -v only
  void warning(const std::string& message);
  void error(const Error& error);
  void progress(const ProgressEvent& event);

  /// A line of data for people; nothing with --json.
  void data(const std::string& line);
  /// An intermediate event; nothing without --json.
  void event(const nlohmann::json& event);
  /// The last line of --json: {"event":"result","schema":1,"verb":...,"ok":...}.
  void result(const std::string& verb, nlohmann::json body);

 private:
  void message(const char* label, const char* color, const std::string& text);
  void clear_bar();
  void write_stdout(const std::string& line);

  ConsoleOptions options_;
  std::mutex mutex_;
  bool bar_drawn_ = false;
  int output_error_ = 0;  ///< errno of the first write to stdout that failed
  std::string last_stage_;
  std::chrono::steady_clock::time_point last_progress_{};
};

/// Names come from cards and archives: their control bytes must not reach the terminal, where they
/// move the cursor and repaint lines. "\x1b[2J" is shown as written here; line breaks and tabs
/// stay.
std::string printable(const std::string& text);

/// Reads NO_COLOR, TERM and isatty.
ConsoleOptions detect_terminal();
/// "1:05" or "2:03:04".
std::string format_duration(double seconds);

}  // namespace orbitfuse::terminal
