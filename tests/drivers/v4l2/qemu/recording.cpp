// SPDX-License-Identifier: BSD-3-Clause
#include "tests/drivers/v4l2/qemu/recording.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace orbitfuse::v4l2::guest {

using namespace std::chrono_literals;

Recording::Recording(V4l2Options options)
    : writer_(*SessionWriter::create(folder_ / "s")),
      source_(std::move(options)),
      recorder_(*writer_, {}) {
  Progress progress;
  progress.cancel = &cancelled_;
  thread_ = std::thread([this, progress] { outcome_ = recorder_.run({&source_}, progress); });
}

Recording::~Recording() {
  cancelled_ = true;
  if (thread_.joinable()) thread_.join();
}

StreamStatus Recording::status() const {
  const std::vector<StreamStatus> all = recorder_.status();
  return all.empty() ? StreamStatus{} : all.front();
}

bool Recording::wait_until(const std::function<bool(const StreamStatus&)>& holds) const {
  for (int i = 0; i < 1200; ++i) {
    const StreamStatus now = status();
    if (holds(now)) return true;
    if (now.ended) return false;
    std::this_thread::sleep_for(50ms);
  }
  return false;
}

bool Recording::wait_for_frames(std::uint64_t more) const {
  const std::uint64_t wanted = status().received + more;
  return wait_until([wanted](const StreamStatus& s) { return s.received >= wanted; });
}

Session Recording::finish() {
  cancelled_ = true;
  thread_.join();
  // A camera that is away at the end says so; its accounts are exact all the same.
  const bool away = status().away.has_value();
  EXPECT_TRUE(outcome_ ||
              outcome_.error().kind == (away ? ErrorKind::device : ErrorKind::cancelled))
      << outcome_.error().message();
  EXPECT_TRUE(writer_->close());
  const auto session = open_session(folder_ / "s");
  EXPECT_TRUE(session) << session.error().message();
  if (!session) return {};
  EXPECT_TRUE(session->complete);
  for (const EventRecord& event : session->events) {
    std::printf("  event %s: %s\n", event.kind.c_str(), event.detail.c_str());
  }
  expect_exact_accounts(*session);
  return *session;
}

void expect_exact_accounts(const Session& session) {
  ASSERT_EQ(session.streams.size(), 1u);
  const StreamRecord& stream = session.streams.front();
  EXPECT_EQ(stream.received + stream.lost, stream.last_sequence - stream.first_sequence + 1);
  EXPECT_EQ(stream.received, session.frames.size());
  std::uint64_t lost = 0;
  for (const GapRecord& gap : session.gaps) {
    lost += gap.count;
    std::printf("  gap %llu at %llu: %s\n", static_cast<unsigned long long>(gap.count),
                static_cast<unsigned long long>(gap.first_sequence), gap.reason.c_str());
  }
  EXPECT_EQ(lost, stream.lost);
  std::printf("  received %llu, lost %llu\n", static_cast<unsigned long long>(stream.received),
              static_cast<unsigned long long>(stream.lost));
}

int count_events(const Session& session, const std::string& kind) {
  return static_cast<int>(std::count_if(session.events.begin(), session.events.end(),
                                        [&](const EventRecord& e) { return e.kind == kind; }));
}

}  // namespace orbitfuse::v4l2::guest
