// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/mesh_making.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <optional>

namespace orbitfuse::view {
namespace {

using std::chrono::milliseconds;

Result<std::string> waited_for(const MeshMaking& making) {
  for (int tries = 0; tries < 3000; ++tries) {
    const auto found = making.found();
    if (!found) return tl::unexpected(found.error());
    if (*found) return **found;
    std::this_thread::sleep_for(milliseconds(10));
  }
  return fail(ErrorKind::unavailable, "test", "no mesh came", "");
}

TEST(MeshMaking, ComesLaterAndStays) {
  const FinishedRun run;
  const RenderTurns turns;
  std::atomic<bool> held{true};
  MeshMaking making(run, turns, [&](const FinishedRun&, const Progress&) -> Result<std::string> {
    while (held) std::this_thread::sleep_for(milliseconds(1));
    return "triangles";
  });
  making.start();
  ASSERT_TRUE(making.found());
  EXPECT_EQ(*making.found(), nullptr);
  held = false;
  EXPECT_EQ(waited_for(making).value(), "triangles");
  making.stop();
  EXPECT_EQ(**making.found(), "triangles");
}

TEST(MeshMaking, WhatWentWrongIsTold) {
  const FinishedRun run;
  const RenderTurns turns;
  MeshMaking making(run, turns, [](const FinishedRun&, const Progress&) -> Result<std::string> {
    return fail(ErrorKind::quality, "surface", "only loose pieces", "choose a larger box");
  });
  making.start();
  EXPECT_EQ(waited_for(making).error().kind, ErrorKind::quality);
  EXPECT_FALSE(MeshMaking(run, turns, {}).found());
}

TEST(MeshMaking, EndsWithTheViewer) {
  const FinishedRun run;
  const RenderTurns turns;
  std::optional<MeshMaking> making;
  making.emplace(run, turns,
                 [](const FinishedRun&, const Progress& progress) -> Result<std::string> {
                   while (!progress.cancelled()) std::this_thread::sleep_for(milliseconds(1));
                   return tl::unexpected(progress.check("surface").error());
                 });
  making->start();
  making.reset();  // or the test never ends
}

TEST(MeshMaking, PicturesGoFirst) {
  const FinishedRun run;
  RenderTurns turns;
  std::atomic<bool> reported{false}, went_on{false};
  MeshMaking making(run, turns,
                    [&](const FinishedRun&, const Progress& progress) -> Result<std::string> {
                      reported = true;
                      progress.report({});
                      went_on = true;
                      return "";
                    });
  RenderTurns::Job job(turns, "page", nullptr);
  {
    const auto turn = job.turn(1);
    ASSERT_TRUE(turn);
    EXPECT_TRUE(turns.busy());
    making.start();
    while (!reported) std::this_thread::yield();
    std::this_thread::sleep_for(milliseconds(100));
    EXPECT_FALSE(went_on);
  }
  EXPECT_FALSE(turns.busy());
  EXPECT_TRUE(waited_for(making));
}

}  // namespace
}  // namespace orbitfuse::view
