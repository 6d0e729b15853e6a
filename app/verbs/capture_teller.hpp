// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <map>
#include <string>

#include "app/cli/verb.hpp"
#include "app/recording/recording.hpp"

namespace orbitfuse::cli {

/// Driver, model and serial, or in words that these aren't known.
std::string described(const DeviceInfo& device);
/// How many files of a camera were no frames, and the last of them; empty: none.
std::string passed_over(const StreamStatus& stream);
/// "thermal0: 2 frames arrived damaged, ..."; empty: none.
std::string damaged(const StreamStatus& stream);

/// Says what came of a key or of a button on the page, and hands it on.
Result<std::string> tell_outcome(terminal::Console& console, Result<std::string> outcome);

/// Says each instruction and each alarm once, and listens to the operator's keys.
class Teller {
 public:
  /// `live`: the operator is there to hear the instructions.
  Teller(Context& context, recording::Recording& recording, bool live, bool view)
      : context_(context), recording_(recording), live_(live), view_(view) {}

  void tick();

 private:
  void draw();
  void tell_alarms(const StreamStatus& stream);
  void tell_correction(const StreamStatus& stream);
  void tell_seldom(const std::string& key, const std::string& words);
  void tell_guide();
  void say_changed(const std::string& key, const std::string& words);
  void listen();

  Context& context_;
  recording::Recording& recording_;
  bool live_, view_;
  std::chrono::steady_clock::time_point drawn_{};
  std::map<std::string, std::string> said_;
  std::map<std::string, std::uint64_t> corrections_told_;
  std::map<std::string, std::chrono::steady_clock::time_point> said_at_;
};

}  // namespace orbitfuse::cli
