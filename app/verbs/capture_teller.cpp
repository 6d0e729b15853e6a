// SPDX-License-Identifier: BSD-3-Clause
#include "app/verbs/capture_teller.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <unistd.h>

namespace orbitfuse::cli {

std::string described(const DeviceInfo& device) {
  std::string words = device.driver;
  for (const std::string& known : {device.model, device.serial})
    if (!known.empty()) words += " " + known;
  if (!device.model.empty() || !device.serial.empty()) return words;
  return words +
         (device.driver == "stills" ? ", camera known from its first photo" : ", model unknown");
}

std::string passed_over(const StreamStatus& s) {
  if (s.passed_over == 0) return {};
  return fmt::format("{}: {} {} passed over, last {}", s.device, s.passed_over,
                     s.passed_over == 1 ? "file" : "files", fmt::join(s.passed_over_last, "; "));
}

std::string damaged(const StreamStatus& s) {
  return s.rejected == 0 ? "" : s.device + ": " + damaged_words(s);
}

void Teller::tick() {
  listen();
  if (view_) draw();
  for (const StreamStatus& s : recording_.status()) {
    tell_alarms(s);
    tell_correction(s);
    tell_seldom(s.device + " passed over", passed_over(s));
    tell_seldom(s.device + " rejected", damaged(s));
  }
  if (recording_.guide()) tell_guide();
}

void Teller::tell_alarms(const StreamStatus& s) {
  const auto say = [&](const char* what, bool now, const std::string& words) {
    say_changed(s.device + what, now ? s.device + ": " + words : "");
  };
  say(" silent", s.silent && !s.away, "no frames");
  say(" away", s.away.has_value(),
      "disconnected" + (s.away ? " (" + s.away->why + ")" : "") + ", reopening");
  say(" notice", !s.notice.empty(), s.notice);
  say(" dropped", s.dropped > 0, "the disk is too slow, frames are dropped and counted");
  say(" unwritten", s.unwritten > 0, "frames could not be written; is the disk full?");
  say(" missing", s.missing > 0, "frames are lost on the way and counted");
}

/// Also one that a camera makes by itself: frames are useless meanwhile.
void Teller::tell_correction(const StreamStatus& s) {
  std::uint64_t& told = corrections_told_[s.device];
  if (s.corrections == told) return;
  told = s.corrections;
  context_.console.info(s.device + ": " + s.correction);
}

/// A card full of other files is told every few seconds, not file by file.
void Teller::tell_seldom(const std::string& key, const std::string& words) {
  constexpr auto pause = std::chrono::seconds(3);
  auto& at = said_at_[key];
  const auto now = std::chrono::steady_clock::now();
  if (words.empty() || now - at < pause) return;
  const std::string before = said_[key];
  say_changed(key, words);
  if (said_[key] != before) at = now;
}

void Teller::tell_guide() {
  const auto total = recording_.guide()->sectors().size();
  for (const LiveCamera& camera : recording_.guide()->cameras()) {
    const int done = recording_.guide()->done_count(camera.modality);
    const std::string words = fmt::format("{} {}/{}: {}", name(camera.modality), done, total,
                                          instruction_for(camera, Operator::at_terminal));
    std::string& last = said_[std::string(name(camera.modality))];
    if (words == last) continue;
    last = words;
    if (live_ && !view_)
      context_.console.info(words);
    else
      context_.console.detail(words);
    context_.console.event({{"event", "guide"},
                            {"modality", name(camera.modality)},
                            {"done", done},
                            {"of", total},
                            {"instruction", instruction_for(camera, Operator::at_terminal)}});
  }
}

/// The whole state once a second, in place on a terminal.
void Teller::draw() {
  const auto now = std::chrono::steady_clock::now();
  if (now - drawn_ < std::chrono::seconds(1)) return;
  drawn_ = now;
  context_.console.data((isatty(STDOUT_FILENO) ? "\033[H\033[J" : "") +
                        terminal_view(recording_.state()));
}

void Teller::say_changed(const std::string& key, const std::string& words) {
  std::string& last = said_[key];
  if (words != last && !words.empty()) context_.console.warning(words);
  last = words;
}

void Teller::listen() {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  if (!isatty(STDIN_FILENO) || poll(&input, 1, 0) <= 0) return;
  char keys[64];
  const ssize_t count = ::read(STDIN_FILENO, keys, sizeof keys);
  if (count <= 0) return;
  tell_outcome(context_.console, keys[0] == 'q'   ? recording_.request_stop()
                                 : keys[0] == 'n' ? recording_.request_correction()
                                                  : recording_.operator_at_station());
}

Result<std::string> tell_outcome(terminal::Console& console, Result<std::string> outcome) {
  if (outcome)
    console.info(*outcome);
  else
    console.warning(outcome.error().message());
  return outcome;
}

}  // namespace orbitfuse::cli
