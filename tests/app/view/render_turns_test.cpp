// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/render_turns.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace orbitfuse::view {
namespace {

void wait_for_waiting(const RenderTurns& turns, int count) {
  while (turns.waiting() != static_cast<std::size_t>(count)) std::this_thread::yield();
}

/// Who came with much to do doesn't hold up who comes with little.
TEST(RenderTurns, TheLeastServedComesNext) {
  RenderTurns turns;
  std::optional<RenderTurns::Turn> held;
  RenderTurns::Job first(turns, "first", nullptr);
  held.emplace(std::move(*first.turn(1)));
  std::string order;  // of who holds the turn
  std::atomic<int> at_work{2};
  const auto work = [&](const char* client, int pieces) {
    return std::jthread([&, client, pieces] {
      RenderTurns::Job job(turns, client, nullptr);
      for (int left = pieces; left > 0; --left) {
        const auto turn = job.turn(1);
        ASSERT_TRUE(turn);
        order += *client;
        wait_for_waiting(turns, at_work - 1);  // whoever wants more has asked for it
        if (left == 1) --at_work;
      }
    });
  };
  {
    const std::jthread a = work("a", 6);
    wait_for_waiting(turns, 1);
    const std::jthread b = work("b", 2);
    wait_for_waiting(turns, 2);
    held.reset();
  }
  EXPECT_EQ(order, "ababaaaa");
}

TEST(RenderTurns, OneAtATime) {
  RenderTurns turns;
  std::atomic<int> inside{0}, most{0}, done{0};
  {
    std::vector<std::jthread> clients;
    for (int c = 0; c < 8; ++c)
      clients.emplace_back([&, c] {
        RenderTurns::Job job(turns, std::to_string(c), nullptr);
        for (int i = 0; i < 20; ++i) {
          const auto turn = job.turn(1);
          ASSERT_TRUE(turn);
          most = std::max(most.load(), ++inside);
          std::this_thread::yield();
          --inside;
          ++done;
        }
      });
  }
  EXPECT_EQ(most, 1);
  EXPECT_EQ(done, 160);
}

TEST(RenderTurns, ANewerJobEndsTheOlder) {
  RenderTurns turns;
  RenderTurns::Job old(turns, "me", nullptr), other(turns, "you", nullptr);
  EXPECT_TRUE(old.turn(1));
  const RenderTurns::Job young(turns, "me", nullptr);
  const auto refused = old.turn(1);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::cancelled);
  EXPECT_FALSE(young.over());
  EXPECT_TRUE(other.turn(1));
}

TEST(RenderTurns, WhoeverLeftIsNotWaitedFor) {
  RenderTurns turns;
  std::atomic<bool> gone{false};
  RenderTurns::Job holder(turns, "holder", nullptr), leaving(turns, "leaving", &gone);
  auto held = std::make_unique<RenderTurns::Turn>(std::move(*holder.turn(1)));
  std::jthread waits([&] { EXPECT_FALSE(leaving.turn(1)); });
  wait_for_waiting(turns, 1);
  gone = true;
  waits.join();  // although the turn is still held
  held.reset();
  EXPECT_TRUE(holder.turn(1));
}

TEST(RenderTurns, TooManyAreRefusedAndClosingEndsAll) {
  RenderTurns turns;
  RenderTurns::Job holder(turns, "holder", nullptr);
  auto held = std::make_unique<RenderTurns::Turn>(std::move(*holder.turn(1)));
  std::atomic<int> unavailable{0}, cancelled{0};
  std::vector<std::jthread> clients;
  for (int c = 0; c < 20; ++c)
    clients.emplace_back([&, c] {
      RenderTurns::Job job(turns, std::to_string(c), nullptr);
      const auto turn = job.turn(1);
      ASSERT_FALSE(turn);
      ++(turn.error().kind == ErrorKind::unavailable ? unavailable : cancelled);
    });
  while (unavailable < 4) std::this_thread::yield();
  turns.close();
  clients.clear();
  EXPECT_EQ(unavailable, 4);
  EXPECT_EQ(cancelled, 16);
  held.reset();
  EXPECT_FALSE(holder.turn(1));
}

}  // namespace
}  // namespace orbitfuse::view
