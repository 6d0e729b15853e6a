// SPDX-License-Identifier: BSD-3-Clause
// Making it from fields: tests/app/view/view_browser_test.cpp.
#include "app/export/viewer_surface.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "app/export/surface_files.hpp"
#include "app/view/surface.hpp"
#include "core/system/file_io.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::exporting {
namespace {
namespace fs = std::filesystem;

/// z = x y on a square, `side` by `side` squares of two triangles.
FieldSurface saddle(int side) {
  FieldSurface surface;
  TriangleMesh& mesh = surface.mesh;
  for (int y = 0; y <= side; ++y)
    for (int x = 0; x <= side; ++x) {
      const double u = static_cast<double>(x) / side, v = static_cast<double>(y) / side;
      mesh.vertices.positions.emplace_back(u, v, u * v);
      mesh.vertices.colors.push_back({static_cast<std::uint8_t>(255 * x / side), 7, 9});
      mesh.vertices.temperatures_k.push_back(static_cast<float>(300 + 10 * v));
      if (x == side || y == side) continue;
      const auto at = static_cast<std::uint32_t>(y * (side + 1) + x);
      const auto above = at + static_cast<std::uint32_t>(side) + 1;
      mesh.triangles.push_back({at, at + 1, above});
      mesh.triangles.push_back({at + 1, above + 1, above});
    }
  surface.fused_triangles = mesh.triangles.size();
  return surface;
}

/// A run without fields: what isn't there already can't be made.
class ViewerSurfaceTest : public ::testing::Test {
 protected:
  ViewerSurfaceTest() {
    run.out = folder.path();
    run.identity = "of this test";
    run.span = {300, 310};
  }

  /// As `orbitfuse export` writes it, with x up and in metres.
  void write_export(const FieldSurface& surface, const SurfaceRequest& request = {},
                    FileOptions how = {}) {
    const auto frame =
        export_frame(Eigen::Vector3d::UnitX(), stages::MetricScale{2, 0.01, "one distance", ""});
    how.made_of = surface_key(run, request);
    ASSERT_TRUE(write_surface(file, run, surface, *frame, how));
  }

  orbitfuse::test::TempFolder folder;
  view::FinishedRun run;
  fs::path file = folder.path() / default_surface_file;
};

std::uint32_t triangles_in(const std::string& bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data(), 4);
  return count;
}

TEST_F(ViewerSurfaceTest, AnExportOfTheSameSurfaceIsTaken) {
  EXPECT_EQ(viewer_surface(run, {}).error().kind, ErrorKind::input);
  const FieldSurface surface = saddle(20);
  write_export(surface);
  const auto taken = viewer_surface(run, {});
  ASSERT_TRUE(taken) << taken.error().message();
  // In the run's world and unit again; positions are rounded on the way.
  // So few triangles are also what a slow machine draws while the camera moves.
  const std::string exact = view::packed(surface.mesh) + view::packed(surface.mesh);
  ASSERT_EQ(taken->size(), exact.size());
  EXPECT_EQ(triangles_in(*taken), 800U);
  float low_and_step[6];
  std::memcpy(low_and_step, taken->data() + 12, sizeof low_and_step);
  for (int d = 0; d < 3; ++d) {
    EXPECT_NEAR(low_and_step[d], 0, 1e-6);
    EXPECT_NEAR(65535 * low_and_step[3 + d], 1, 1e-6);
  }
  const std::size_t colors = 8 + 28 + 6 * surface.mesh.vertices.size();
  const std::size_t one = exact.size() / 2;
  EXPECT_EQ(taken->substr(colors, one - colors), exact.substr(colors, one - colors));
  EXPECT_EQ(taken->substr(one), taken->substr(0, one));
}

TEST_F(ViewerSurfaceTest, ALargerOneIsReduced) {
  write_export(saddle(200));
  const auto taken = viewer_surface(run, {});
  ASSERT_TRUE(taken);
  EXPECT_LE(triangles_in(*taken), static_cast<std::uint32_t>(viewer_triangles));
  EXPECT_GT(triangles_in(*taken), 0.9 * viewer_triangles);
  const std::uint32_t fine = triangles_in(*taken);
  std::uint32_t vertices = 0;
  std::memcpy(&vertices, taken->data() + 8, 4);
  const std::size_t cloud = (8 + 28 + (9 * vertices + 1) / 2 * 2 + 2 * vertices + 3) / 4 * 4;
  const std::uint32_t moving = triangles_in(taken->substr(cloud + 12 * std::size_t{fine}));
  EXPECT_LE(moving, static_cast<std::uint32_t>(viewer_triangles_moving));
  EXPECT_GT(moving, 0.9 * viewer_triangles_moving);
}

TEST_F(ViewerSurfaceTest, IsKeptUntilTheFieldsChange) {
  write_export(saddle(20));
  const auto taken = viewer_surface(run, {});
  ASSERT_TRUE(taken);
  fs::remove_all(file.parent_path());
  EXPECT_EQ(viewer_surface(run, {}), *taken);
  run.config.render.min_opacity += 0.1;
  EXPECT_FALSE(viewer_surface(run, {}));
  run.config.render.min_opacity -= 0.1;
  EXPECT_TRUE(viewer_surface(run, {}));
  run.identity = "trained again";
  EXPECT_FALSE(viewer_surface(run, {}));
}

TEST_F(ViewerSurfaceTest, WhatIsDamagedIsNotShown) {
  write_export(saddle(20));
  const auto taken = viewer_surface(run, {});
  ASSERT_TRUE(taken);
  const fs::path kept = run.out / viewer_surface_file;
  const std::string whole = *read_file(kept), exported = *read_file(file);
  ASSERT_TRUE(write_file_atomic(file, exported + " "));
  for (const std::string& other :
       {std::string(), whole.substr(0, 40), whole.substr(0, whole.size() / 2), whole + "x",
        "X" + whole.substr(1)}) {
    ASSERT_TRUE(write_file_atomic(kept, other));
    EXPECT_FALSE(viewer_surface(run, {})) << other.size();
  }
  ASSERT_TRUE(write_file_atomic(file, exported));
  EXPECT_EQ(viewer_surface(run, {}), *taken);
  EXPECT_EQ(*read_file(kept), whole);
}

TEST_F(ViewerSurfaceTest, AnotherExportIsNotTaken) {
  FieldSurface coarse = saddle(20);
  coarse.fused_triangles = 100'000;
  write_export(coarse);
  EXPECT_FALSE(viewer_surface(run, {})) << "coarser";
  FileOptions painted;
  painted.colors = VertexColors::temperature;
  write_export(saddle(20), {}, painted);
  EXPECT_FALSE(viewer_surface(run, {})) << "painted by temperature";
  SurfaceRequest part;
  part.crop = Crop::box;
  part.box = {Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 0)};
  write_export(saddle(20), part);
  EXPECT_FALSE(viewer_surface(run, {})) << "a part";
  SurfaceRequest hanging;
  hanging.surface.surface.without_ground = true;
  write_export(saddle(20), hanging);
  EXPECT_FALSE(viewer_surface(run, {})) << "without its ground";
  for (const char* about : {"", "[]", "{}", R"({"made_of": 3, "file_hash": []})"}) {
    ASSERT_TRUE(write_file_atomic(file.string() + ".json", about));
    EXPECT_FALSE(viewer_surface(run, {})) << about;
  }
}

TEST_F(ViewerSurfaceTest, AFolderThatCannotBeWrittenToIsShown) {
  write_export(saddle(20));
  ASSERT_TRUE(write_file_atomic(run.out / "view", "no folder"));
  EXPECT_TRUE(viewer_surface(run, {}));
}

TEST_F(ViewerSurfaceTest, WithoutAnIdentityNothingIsTaken) {
  run.identity.clear();
  write_export(saddle(20));
  EXPECT_FALSE(viewer_surface(run, {}));
}

}  // namespace
}  // namespace orbitfuse::exporting
