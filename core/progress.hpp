// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>

#include "core/result.hpp"

namespace orbitfuse {

struct ProgressEvent {
  std::string stage;  ///< e.g. "train.visible"
  double done = 0, total = 0;
  std::optional<double> eta_s = {};  ///< to the end; absent: unknown
  std::string detail = {};           ///< e.g. "held-out 24.3 dB"
};

/// Passed down every long operation: where to report, and whether to stop. The app owns it.
struct Progress {
  std::function<void(const ProgressEvent&)> report = [](const ProgressEvent&) {};
  const std::atomic<bool>* cancel = nullptr;  ///< set by Ctrl-C

  bool cancelled() const { return cancel && cancel->load(std::memory_order_relaxed); }
  /// Error of kind cancelled when the user asked to stop. Who can go on from where it stopped says
  /// so in its place.
  Status check(const std::string& stage) const {
    if (!cancelled()) return {};
    return fail(ErrorKind::cancelled, stage, "stopped by the user", "call it again");
  }
};

/// One thing a stage did not do, why, and what that saved or cost; shown in the report.
struct Skip {
  std::string what;    ///< e.g. "thermal COLMAP"
  std::string why;     ///< e.g. "11 of 276 pairs verified"
  std::string effect;  ///< e.g. "saved 40 CPU s; poses from the orbit prior"
};

}  // namespace orbitfuse
