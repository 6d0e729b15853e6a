// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <thread>

#include "capture/recording/recorder.hpp"
#include "drivers/v4l2/v4l2_source.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::v4l2::guest {

/// One camera recorded by the real recorder into a session of its own, on a thread.
class Recording {
 public:
  explicit Recording(V4l2Options options);
  ~Recording();
  /// False when that takes longer than a minute; the tests are about what happens, not how fast.
  bool wait_until(const std::function<bool(const StreamStatus&)>& holds) const;
  bool wait_for_frames(std::uint64_t more) const;
  /// Ends it and opens the session, whose accounts must be exact.
  Session finish();
  StreamStatus status() const;

 private:
  test::TempFolder folder_;
  std::unique_ptr<SessionWriter> writer_;
  V4l2Source source_;
  Recorder recorder_;
  std::atomic<bool> cancelled_{false};
  Status outcome_;
  std::thread thread_;
};

/// received + lost == last - first + 1, and the frames and gaps in the manifest are those.
void expect_exact_accounts(const Session& session);
int count_events(const Session& session, const std::string& kind);

}  // namespace orbitfuse::v4l2::guest
