// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/console.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace orbitfuse::terminal {
namespace {

constexpr auto redraw_interval = std::chrono::milliseconds(100);
constexpr int bar_width = 24;

/// A reader that has left (`2>&1 | head`) ends no run: results are on disk, the exit code tells.
void to_stderr(const std::string& text) { std::fputs(text.c_str(), stderr); }

std::string bar_line(const ProgressEvent& e) {
  const double share = e.total > 0 ? std::clamp(e.done / e.total, 0.0, 1.0) : 0.0;
  const int filled = static_cast<int>(std::lround(share * bar_width));
  std::string line = fmt::format("{:<14} [{}{}] {:3.0f} %", e.stage, std::string(filled, '='),
                                 std::string(bar_width - filled, ' '), 100 * share);
  if (e.eta_s) line += "  " + format_duration(*e.eta_s) + " left";
  if (!e.detail.empty()) line += "  " + e.detail;
  return line.size() > 110 ? line.substr(0, 110) : line;
}

/// File names are bytes; what of them is not UTF-8 shows as U+FFFD.
std::string line_of(const nlohmann::json& j) {
  return j.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

ConsoleOptions detect_terminal() {
  const char* term = std::getenv("TERM");
  ConsoleOptions options;
  options.terminal = isatty(STDERR_FILENO) && term && std::string(term) != "dumb";
  const char* no_color = std::getenv("NO_COLOR");
  options.color = options.terminal && !(no_color && *no_color);
  return options;
}

std::string format_duration(double seconds) {
  const long s = std::lround(std::max(0.0, seconds));
  return s >= 3600 ? fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
                   : fmt::format("{}:{:02}", s / 60, s % 60);
}

void Console::clear_bar() {
  if (bar_drawn_) std::fputs("\r\033[K", stderr);
  bar_drawn_ = false;
}

void Console::write_stdout(const std::string& line) {
  const std::string text = line + '\n';
  const bool written =
      std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0;
  if (!written && output_error_ == 0) output_error_ = errno;
}

Status Console::output_status() const {
  if (output_error_ == 0 || output_error_ == EPIPE) return {};
  return fail(ErrorKind::device, "standard output", std::strerror(output_error_),
              "send it where there is room; what was made is on disk");
}

std::string printable(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    const auto next = i + 1 < text.size() ? static_cast<unsigned char>(text[i + 1]) : 0u;
    if ((c < 0x20 && c != '\n' && c != '\t') || c == 0x7f) {
      out += fmt::format("\\x{:02x}", c);
    } else if (c == 0xc2 && next >= 0x80 &&
               next < 0xa0) {  // the same controls as two bytes of UTF-8
      out += fmt::format("\\x{:02x}", next);
      ++i;
    } else {
      out += text[i];
    }
  }
  return out;
}

void Console::message(const char* label, const char* color, const std::string& text) {
  const std::lock_guard lock(mutex_);
  clear_bar();
  if (options_.color && *color)
    to_stderr(fmt::format("{}{}\033[0m{}\n", color, label, printable(text)));
  else
    to_stderr(fmt::format("{}{}\n", label, printable(text)));
}

void Console::info(const std::string& text) {
  if (options_.verbosity >= 0) message("", "", text);
}

void Console::detail(const std::string& text) {
  if (options_.verbosity > 0) message("", "", text);
}

void Console::warning(const std::string& text) {
  if (options_.verbosity >= 0) message("warning: ", "\033[33m", text);
  event({{"event", "warning"}, {"message", text}});
}

void Console::error(const Error& error) { message("error: ", "\033[31m", error.message()); }

void Console::progress(const ProgressEvent& e) {
  const std::lock_guard lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  const bool due =
      now - last_progress_ >= redraw_interval || e.stage != last_stage_ || e.done >= e.total;
  if (!due) return;
  last_progress_ = now;
  last_stage_ = e.stage;
  if (options_.json) {
    nlohmann::json j = {
        {"event", "progress"}, {"stage", e.stage}, {"done", e.done}, {"total", e.total}};
    j["eta_s"] = e.eta_s ? nlohmann::json(*e.eta_s) : nlohmann::json(nullptr);
    if (!e.detail.empty()) j["detail"] = e.detail;
    write_stdout(line_of(j));
  } else if (options_.terminal && options_.verbosity >= 0) {
    to_stderr(fmt::format("\r\033[K{}", printable(bar_line(e))));
    std::fflush(stderr);
    bar_drawn_ = true;
  }
}

void Console::data(const std::string& line) {
  if (options_.json) return;
  const std::lock_guard lock(mutex_);
  clear_bar();
  write_stdout(printable(line));
}

void Console::event(const nlohmann::json& event) {
  if (!options_.json) return;
  const std::lock_guard lock(mutex_);
  write_stdout(line_of(event));
}

void Console::result(const std::string& verb, nlohmann::json body) {
  body["event"] = "result";
  body["schema"] = json_schema;
  body["verb"] = verb;
  event(body);
}

}  // namespace orbitfuse::terminal
