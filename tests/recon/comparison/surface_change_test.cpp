// SPDX-License-Identifier: BSD-3-Clause
#include "recon/comparison/surface_change.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/recon/comparison/yard.hpp"

namespace orbitfuse::comparison {
namespace {
using test::crate;
using test::house;
using test::shed;

KnownSurface known(const TriangleMesh& mesh, float noise = 0) {
  return {&mesh, std::vector<float>(mesh.vertices.size(), noise), test::cameras_round()};
}

bool on(const test::Box& box, const Eigen::Vector3d& p, double least_height) {
  return p.x() > box.x - 0.01 && p.x() < box.x + box.width + 0.01 && p.y() > box.y - 0.01 &&
         p.y() < box.y + box.depth + 0.01 && p.z() > least_height;
}

TEST(SurfaceChange, TheSameYardHoldsStill) {
  const TriangleMesh fine = test::yard({house, shed, crate}, 0.06),
                     coarse = test::yard({house, shed, crate}, 0.11);
  const auto change = surface_change(known(fine), known(coarse), {}, {}, {});
  ASSERT_TRUE(change) << change.error().message();
  std::size_t same = 0, surface = 0;
  for (std::size_t i = 0; i < change->size(); ++i) {
    EXPECT_NE((*change)[i], SurfaceChange::changed);
    if (fine.vertices.normals[i].isZero()) continue;  // below a box: no surface
    ++surface;
    same += (*change)[i] == SurfaceChange::same;
  }
  EXPECT_GT(same, 0.97 * static_cast<double>(surface));
}

TEST(SurfaceChange, AMovedBoxIsChangedAndTheGroundBelowItWasNotSeen) {
  const test::Box elsewhere{0.8, -1.6, crate.width, crate.depth, crate.height};
  const TriangleMesh before = test::yard({house, shed, crate}),
                     after = test::yard({house, shed, elsewhere});
  const auto change = surface_change(known(after), known(before), {}, {}, {});
  ASSERT_TRUE(change) << change.error().message();
  int came = 0, changed_elsewhere = 0, below = 0, below_not_seen = 0;
  for (std::size_t i = 0; i < change->size(); ++i) {
    const Eigen::Vector3d& p = after.vertices.positions[i];
    const bool changed = (*change)[i] == SurfaceChange::changed;
    if (on(elsewhere, p, 0.1)) {
      came += changed;
      EXPECT_TRUE(changed) << p.transpose();
    } else {
      changed_elsewhere += changed && !on(elsewhere, p, -1);
    }
    if (p.z() == 0 && (p.head<2>() - Eigen::Vector2d(crate.x + 0.2, crate.y + 0.2)).norm() < 0.1) {
      ++below;
      below_not_seen += (*change)[i] == SurfaceChange::not_seen;
    }
  }
  EXPECT_GT(came, 50);
  EXPECT_EQ(changed_elsewhere, 0);
  EXPECT_GT(below, 3);
  EXPECT_EQ(below_not_seen, below);
}

TEST(SurfaceChange, WhatTheDepthsNoiseExplainsIsNoChange) {
  const TriangleMesh before = test::yard({house, shed, crate});
  const TriangleMesh after = test::moved(before, {1, Eigen::Quaterniond::Identity(), {0, 0, 0.08}});
  const auto count = [&](float noise) {
    const auto change = surface_change(known(after, noise), known(before, noise), {}, {}, {});
    EXPECT_TRUE(change);
    return std::count(change->begin(), change->end(), SurfaceChange::changed);
  };
  EXPECT_GT(count(0.001F), 500);
  EXPECT_EQ(count(0.05F), 0);
  // Unknown noise takes the median of what is known.
  KnownSurface half = known(after, 0.05F);
  for (std::size_t i = 0; i < half.depth_noise.size(); i += 2)
    half.depth_noise[i] = std::numeric_limits<float>::quiet_NaN();
  const auto change = surface_change(half, known(before, 0.05F), {}, {}, {});
  ASSERT_TRUE(change);
  EXPECT_EQ(std::count(change->begin(), change->end(), SurfaceChange::changed), 0);
}

TEST(SurfaceChange, WithoutCamerasNothingIsSaidToHaveMoved) {
  const TriangleMesh before = test::yard({house}), after = test::yard({house, crate});
  KnownSurface blind = known(before);
  blind.views.clear();
  const auto change = surface_change(known(after), blind, {}, {}, {});
  ASSERT_TRUE(change);
  EXPECT_EQ(std::count(change->begin(), change->end(), SurfaceChange::changed), 0);
  EXPECT_GT(std::count(change->begin(), change->end(), SurfaceChange::not_seen), 50);
}

TEST(SurfaceChange, BrokenInputIsNamed) {
  const TriangleMesh mesh = test::yard({house});
  EXPECT_EQ(surface_change({}, known(mesh), {}, {}, {}).error().kind, ErrorKind::input);
  EXPECT_EQ(surface_change(known(mesh), {}, {}, {}, {}).error().kind, ErrorKind::input);
  KnownSurface short_noise = known(mesh);
  short_noise.depth_noise.pop_back();
  EXPECT_EQ(surface_change(short_noise, known(mesh), {}, {}, {}).error().kind, ErrorKind::input);
  Similarity3d none;
  none.translation.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(surface_change(known(mesh), known(mesh), none, {}, {}).error().kind, ErrorKind::input);
  none = {0, Eigen::Quaterniond::Identity(), {0, 0, 0}};
  EXPECT_EQ(surface_change(known(mesh), known(mesh), none, {}, {}).error().kind, ErrorKind::input);
  // A vertex that is nowhere is not seen.
  TriangleMesh scratched = mesh;
  scratched.vertices.positions[7].setConstant(std::numeric_limits<double>::infinity());
  const auto change = surface_change(known(scratched), known(scratched), {}, {}, {});
  ASSERT_TRUE(change);
  EXPECT_EQ((*change)[7], SurfaceChange::not_seen);
}

}  // namespace
}  // namespace orbitfuse::comparison
