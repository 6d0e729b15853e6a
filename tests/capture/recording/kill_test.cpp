// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "capture/recording/session_writer.hpp"
#include "core/image/image_io.hpp"
#include "tests/capture/scripted_source.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

/// Records without end and tells the parent of every frame it acknowledged.
[[noreturn]] void record_forever(const std::filesystem::path& folder, int acknowledge_fd) {
  auto writer = *SessionWriter::create(folder);
  if (!writer->add_device({"thermal0", Modality::thermal, "test", "", "", {}})) _exit(1);
  for (std::uint64_t id = 0;; ++id) {
    if (!writer->append("thermal0", test::frame_delivery(id, test::thermal_pixels(96, 64)).frame))
      _exit(1);
    const std::uint64_t done = id + 1;
    if (::write(acknowledge_fd, &done, sizeof done) != sizeof done) _exit(1);
  }
}

TEST(Kill, EveryAcknowledgedFrameIsReadableAfterSigkillAtRandomMoments) {
  std::uint32_t state = 7;
  for (int round = 0; round < 100; ++round) {
    const test::TempFolder folder;
    int fds[2];
    ASSERT_EQ(::pipe(fds), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      ::close(fds[0]);
      record_forever(folder / "s", fds[1]);
    }
    ::close(fds[1]);
    std::uint64_t acknowledged = 0, value = 0;
    ASSERT_EQ(::read(fds[0], &value, sizeof value), static_cast<ssize_t>(sizeof value));
    acknowledged = value;
    state = state * 1664525u + 1013904223u;
    ::usleep(state % 20000);
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    while (::read(fds[0], &value, sizeof value) == static_cast<ssize_t>(sizeof value))
      acknowledged = value;
    ::close(fds[0]);

    const auto session = open_session(folder / "s");
    ASSERT_TRUE(session) << session.error().message();
    EXPECT_FALSE(session->complete);
    ASSERT_GE(session->frames.size(), acknowledged);
    for (const FrameRecord& frame : session->frames)
      ASSERT_TRUE(read_thermal_k(session->path_of(frame)));
    ASSERT_TRUE(SessionWriter::resume(folder / "s"));
  }
}

}  // namespace
}  // namespace orbitfuse
