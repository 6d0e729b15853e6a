// SPDX-License-Identifier: BSD-3-Clause
#include "app/export/viewer_surface.hpp"

#include <gtest/gtest.h>

#include <atomic>

#include "app/export/surface_files.hpp"
#include "app/view/surface.hpp"
#include "core/system/file_io.hpp"
#include "tests/app/view/toy_run.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::exporting {
namespace {
namespace fs = std::filesystem;

class ViewerSurfaceTest : public ::testing::Test {
 protected:
  ViewerSurfaceTest() {
    run = view::test::toy_run(folder.path());
    run.identity = "of this test";
    stopped.cancel = &yes;
  }

  /// The run's export, turned, in metres; as `orbitfuse export` without options writes it.
  void export_it(const SurfaceRequest& request = {}, FileOptions how = {}) {
    const auto surface = surface_of_run(run, request, {});
    ASSERT_TRUE(surface) << surface.error().message();
    exported_triangles = surface->mesh.triangles.size();
    const auto frame =
        export_frame(Eigen::Vector3d::UnitX(), stages::MetricScale{2, 0.01, "one distance", ""});
    how.made_of = surface_key(run, request);
    ASSERT_TRUE(write_surface(run.out / default_surface_file, run, *surface, *frame, how));
  }
  /// What is there already: nothing can be made.
  Result<std::string> there() const { return viewer_surface(run, stopped); }

  orbitfuse::test::TempFolder folder;
  view::FinishedRun run;
  std::size_t exported_triangles = 0;
  const std::atomic<bool> yes{true};
  Progress stopped;
};

std::uint32_t triangles_in(const std::string& bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data(), 4);
  return count;
}

TEST_F(ViewerSurfaceTest, IsTheExportsAndKeptUntilTheFieldsChange) {
  EXPECT_EQ(there().error().kind, ErrorKind::cancelled);
  const auto made = viewer_surface(run, {});
  ASSERT_TRUE(made) << made.error().message();
  SurfaceRequest request;
  request.surface.surface.triangles = viewer_triangles;
  EXPECT_EQ(*made, view::packed(surface_of_run(run, request, {})->mesh));
  EXPECT_GT(triangles_in(*made), 100U);
  EXPECT_LE(triangles_in(*made), static_cast<std::uint32_t>(viewer_triangles));
  EXPECT_EQ(there(), *made);

  run.identity = "trained again";
  EXPECT_FALSE(there());
  ASSERT_TRUE(viewer_surface(run, {}));
  EXPECT_TRUE(there());
}

TEST_F(ViewerSurfaceTest, WhatIsDamagedIsMadeAnew) {
  const auto made = viewer_surface(run, {});
  ASSERT_TRUE(made);
  const fs::path file = run.out / viewer_surface_file;
  const std::string whole = *read_file(file);
  for (std::string other : {std::string(), whole.substr(0, 40), whole.substr(0, whole.size() / 2),
                            whole + "x", "X" + whole.substr(1)}) {
    ASSERT_TRUE(write_file_atomic(file, other));
    EXPECT_FALSE(there()) << other.size();
  }
  EXPECT_EQ(viewer_surface(run, {}), *made);
  EXPECT_EQ(*read_file(file), whole);
}

TEST_F(ViewerSurfaceTest, AnExportOfTheSameSurfaceIsTaken) {
  export_it();
  const auto taken = there();
  ASSERT_TRUE(taken) << taken.error().message();
  EXPECT_EQ(triangles_in(*taken), exported_triangles);  // all: they are few
  // In the run's world and unit again: the same box.
  fs::remove_all((run.out / viewer_surface_file).parent_path());
  fs::remove_all((run.out / default_surface_file).parent_path());
  const auto made = viewer_surface(run, {});
  ASSERT_TRUE(made);
  float box[2][6];
  for (int i = 0; i < 2; ++i) std::memcpy(box[i], (i == 0 ? *taken : *made).data() + 12, 24);
  for (int d = 0; d < 3; ++d) {
    EXPECT_NEAR(box[0][d], box[1][d], 1e-4);
    EXPECT_NEAR(box[0][3 + d], box[1][3 + d], 1e-7);
  }
}

TEST_F(ViewerSurfaceTest, AnotherExportIsNotTaken) {
  SurfaceRequest coarse;
  coarse.surface.surface.triangles = 60;
  export_it(coarse);
  EXPECT_FALSE(there()) << "coarser";
  FileOptions painted;
  painted.colors = VertexColors::temperature;
  export_it({}, painted);
  EXPECT_FALSE(there()) << "painted by temperature";
  SurfaceRequest part;
  part.crop = Crop::box;
  part.box = {Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 0)};
  export_it(part);
  EXPECT_FALSE(there()) << "a part";
  export_it();
  const fs::path file = run.out / default_surface_file;
  ASSERT_TRUE(write_file_atomic(file, *read_file(file) + " "));
  EXPECT_FALSE(there()) << "changed since";
  export_it();
  run.identity = "trained again";
  EXPECT_FALSE(there()) << "of other fields";
}

TEST_F(ViewerSurfaceTest, AFolderThatCannotBeWrittenToIsShown) {
  ASSERT_TRUE(write_file_atomic(run.out / "view", "no folder"));
  EXPECT_TRUE(viewer_surface(run, {}));
  run.identity.clear();
  EXPECT_TRUE(viewer_surface(run, {}));
}

TEST_F(ViewerSurfaceTest, WhyThereIsNoneIsTold) {
  run.views.clear();
  EXPECT_EQ(viewer_surface(run, {}).error().kind, ErrorKind::input);
}

}  // namespace
}  // namespace orbitfuse::exporting
