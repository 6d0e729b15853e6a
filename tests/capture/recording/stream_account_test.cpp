// SPDX-License-Identifier: BSD-3-Clause
#include "capture/recording/stream_account.hpp"

#include <gtest/gtest.h>

namespace orbitfuse {
namespace {

using Loss = StreamAccount::Loss;

TEST(StreamAccount, ReceivedPlusLostIsTheSpanForRandomStreams) {
  std::uint32_t state = 1;
  const auto random = [&state](std::uint32_t below) {
    state = state * 1664525u + 1013904223u;
    return (state >> 8) % below;
  };
  for (int round = 0; round < 200; ++round) {
    StreamAccount account("d");
    std::uint64_t id = random(70000), gaps = 0;
    for (int i = 0; i < 100; ++i) {
      id += random(4);
      if (!account.see(id)) continue;
      const auto fate = random(10);
      if (fate < 7) {
        account.receive();
      } else {
        account.lose(id, fate == 7 ? Loss::rejected : Loss::dropped, fate == 7 ? "bad" : "slow");
      }
      for (const GapRecord& gap : account.take_gaps(id)) gaps += gap.count;
    }
    for (const GapRecord& gap : account.take_gaps(std::nullopt)) gaps += gap.count;
    const StreamRecord r = account.record();
    EXPECT_EQ(r.received + r.lost, r.last_sequence - r.first_sequence + 1);
    EXPECT_EQ(gaps, r.lost);
  }
}

TEST(StreamAccount, NeighboursWithOneReasonAreOneGap) {
  StreamAccount account("d");
  account.see(1);
  account.receive();
  for (std::uint64_t id = 2; id <= 6; ++id) {
    account.see(id);
    account.lose(id, Loss::dropped, "slow");
  }
  EXPECT_TRUE(account.take_gaps(1).empty());  // may still grow
  const auto gaps = account.take_gaps(7);
  ASSERT_EQ(gaps.size(), 1u);
  EXPECT_EQ(gaps[0].first_sequence, 2u);
  EXPECT_EQ(gaps[0].count, 5u);
}

TEST(StreamAccount, WhatIsForgottenComesAgain) {
  for (const bool resumed : {false, true}) {
    StreamAccount account("d", resumed ? std::optional<std::uint64_t>(3) : std::nullopt);
    EXPECT_FALSE(resumed && account.see(2));
    account.see(5);
    account.lose(5, Loss::dropped, "not written");
    account.see(7);
    account.lose(7, Loss::rejected, "bad");
    EXPECT_EQ(account.take_gaps(5).size(), resumed ? 1u : 0u);  // 3 and 4
    account.forget_from(5);
    EXPECT_EQ(account.counts().any, resumed);
    EXPECT_EQ(account.counts().lost(), resumed ? 2u : 0u);
    EXPECT_TRUE(account.take_gaps(std::nullopt).empty());
    EXPECT_FALSE(account.see(4));
    ASSERT_TRUE(account.see(5));
    account.receive();
    const StreamRecord r = account.record();
    EXPECT_EQ(r.first_sequence, resumed ? 3u : 5u);
    EXPECT_EQ(r.received + r.lost, r.last_sequence - r.first_sequence + 1);
  }
}

TEST(StreamAccount, IdsThatDoNotRiseAreRefused) {
  StreamAccount account("d");
  EXPECT_TRUE(account.see(5));
  EXPECT_FALSE(account.see(5));
  EXPECT_FALSE(account.see(4));
  EXPECT_FALSE(account.counts().missing);
}

}  // namespace
}  // namespace orbitfuse
