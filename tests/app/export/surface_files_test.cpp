// SPDX-License-Identifier: BSD-3-Clause
#include "app/export/surface_files.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <cmath>
#include <limits>

#include "app/export/glb.hpp"
#include "app/stages/artifacts.hpp"
#include "core/formats/ply.hpp"
#include "core/geometry/geometry_json.hpp"
#include "core/system/file_io.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::exporting {
namespace {
namespace fs = std::filesystem;
using ::testing::HasSubstr;
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

fs::path scratch() {
  const fs::path folder = fs::path(::testing::TempDir()) / "orbitfuse_export" /
                          ::testing::UnitTest::GetInstance()->current_test_info()->name();
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

TriangleMesh tetrahedron() {
  TriangleMesh mesh;
  mesh.vertices.positions = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
  mesh.vertices.normals = {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}};
  mesh.vertices.colors = {{255, 0, 0}, {0, 255, 0}, {0, 0, 255}, {128, 128, 128}};
  mesh.vertices.temperatures_k = {300.5F, 310.25F, nan, 290};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return mesh;
}

template <class Number>
std::vector<Number> numbers(const tinygltf::Model& model, int accessor) {
  const auto& a = model.accessors.at(static_cast<std::size_t>(accessor));
  const auto& view = model.bufferViews.at(static_cast<std::size_t>(a.bufferView));
  const auto count = a.count * static_cast<std::size_t>(tinygltf::GetNumComponentsInType(
                                   static_cast<std::uint32_t>(a.type)));
  std::vector<Number> result(count);
  std::memcpy(result.data(), model.buffers[0].data.data() + view.byteOffset,
              count * sizeof(Number));
  return result;
}

TEST(Glb, HoldsTheMeshWithYUpAndKelvin) {
  const fs::path file = scratch() / "t.glb";
  ASSERT_TRUE(write_glb(file, tetrahedron(), {{"unit", "metre"}, {"vertices", 4}}));
  tinygltf::Model model;
  std::string error, warning;
  ASSERT_TRUE(tinygltf::TinyGLTF().LoadBinaryFromFile(&model, &error, &warning, file.string()))
      << error;
  EXPECT_EQ(error + warning, "");
  EXPECT_EQ(model.asset.extras.Get("unit").Get<std::string>(), "metre");
  auto& p = model.meshes.at(0).primitives.at(0);
  EXPECT_EQ(numbers<float>(model, p.attributes.at("POSITION")),
            (std::vector<float>{0, 0, 0, 1, 0, 0, 0, 0, -2, 0, 3, 0}));
  // glTF has no NaN: 0 kelvin is "none".
  EXPECT_EQ(numbers<float>(model, p.attributes.at("_TEMPERATURE")),
            (std::vector<float>{300.5F, 310.25F, 0, 290}));
  const auto colors = numbers<std::uint16_t>(model, p.attributes.at("COLOR_0"));
  EXPECT_EQ(colors[0], 65535);
  EXPECT_NEAR(colors[12], 0.2158 * 65535, 20);  // sRGB 128 is 21.6 % of the light
  for (std::size_t i = 0; i < 12; i += 3) {
    const auto n = numbers<float>(model, p.attributes.at("NORMAL"));
    EXPECT_NEAR(std::hypot(n[i], n[i + 1], n[i + 2]), 1, 1e-6);
  }
  EXPECT_EQ(numbers<std::uint32_t>(model, p.indices).size(), 12U);
}

TEST(Glb, ComesBackAsItWasWritten) {
  const fs::path file = scratch() / "t.glb";
  const TriangleMesh mesh = tetrahedron();
  ASSERT_TRUE(write_glb(file, mesh, {}));
  const auto back = read_glb(file);
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->vertices.positions, mesh.vertices.positions);
  EXPECT_EQ(back->vertices.colors, mesh.vertices.colors);
  EXPECT_EQ(back->triangles, mesh.triangles);
  EXPECT_EQ(back->vertices.temperatures_k[1], 310.25F);
  EXPECT_TRUE(std::isnan(back->vertices.temperatures_k[2]));
  const std::string whole = *read_file(file);
  for (const std::size_t size : {std::size_t{0}, std::size_t{11}, whole.size() / 2}) {
    ASSERT_TRUE(write_file_atomic(file, whole.substr(0, size)));
    EXPECT_EQ(read_glb(file).error().kind, ErrorKind::input) << size;
  }
  std::string stray = whole;
  stray[stray.size() - 1] = '\x7f';  // of the last corner
  ASSERT_TRUE(write_file_atomic(file, stray));
  EXPECT_THAT(read_glb(file).error().message(), HasSubstr("none of its vertices"));
  EXPECT_FALSE(read_glb(file.parent_path() / "none.glb"));
}

TEST(Glb, EmptyAndBrokenMeshesAreNamed) {
  const fs::path file = scratch() / "t.glb";
  EXPECT_EQ(write_glb(file, {}, {}).error().kind, ErrorKind::input);
  TriangleMesh broken = tetrahedron();
  broken.vertices.positions[1].x() = std::nan("");
  EXPECT_THAT(write_glb(file, broken, {}).error().message(), HasSubstr("not finite"));
  EXPECT_FALSE(fs::exists(file));
}

struct Exported {
  view::FinishedRun run;
  FieldSurface surface;
};

Exported exported() {
  Exported e;
  e.run.out = "out";
  e.run.span = {290, 310};
  e.surface.mesh = tetrahedron();
  e.surface.without_temperature = 1;
  return e;
}

TEST(SurfaceFiles, EachFormatIsWrittenWithItsFrame) {
  const fs::path folder = scratch();
  const Exported e = exported();
  const stages::MetricScale scale{2, 0.01, "one distance", ""};
  const auto frame = export_frame(Eigen::Vector3d::UnitX(), scale);
  ASSERT_TRUE(frame);
  for (const char* name : {"a.glb", "a.ply", "a.obj", "a.las"}) {
    ASSERT_TRUE(write_surface(folder / name, e.run, e.surface, *frame, {})) << name;
    const auto about = stages::read_json(folder / (std::string(name) + ".json"));
    ASSERT_TRUE(about);
    EXPECT_EQ(about->at("unit"), "metre");
    EXPECT_EQ(about->at("vertices_without_temperature"), 1);
    EXPECT_EQ(about->at("scale").at("source"), "one distance");
  }
  const auto cloud = read_ply(folder / "a.ply");
  ASSERT_TRUE(cloud);
  EXPECT_NEAR((cloud->positions[1] - Eigen::Vector3d(0, 0, 2)).norm(), 0, 1e-12);  // x is up, twice
  EXPECT_NEAR((cloud->normals[1] - Eigen::Vector3f(0, 0, 1)).norm(), 0, 1e-6);
  EXPECT_EQ(cloud->temperatures_k[0], 300.5F);
  EXPECT_TRUE(std::isnan(cloud->temperatures_k[2]));
}

/// The first vertex but one as a program reads it, through the matrices of the sidecar.
TEST(SurfaceFiles, ASidecarTellsTheFilesOwnAxes) {
  const fs::path folder = scratch();
  const Exported e = exported();
  const auto frame =
      export_frame(Eigen::Vector3d::UnitX(), stages::MetricScale{2, 0.01, "one distance", ""});
  ASSERT_TRUE(frame);
  for (const char* name : {"a.glb", "a.ply"}) {
    const bool glb = std::string(name) == "a.glb";
    ASSERT_TRUE(write_surface(folder / name, e.run, e.surface, *frame, {}));
    const auto about = stages::read_json(folder / (std::string(name) + ".json"));
    ASSERT_TRUE(about);
    EXPECT_EQ(about->at("schema"), 2);
    EXPECT_EQ(about->at("up"), glb ? "y" : "z");
    const std::string bytes = *read_file(folder / name);
    for (const char* key : {"world_from_export", "export_from_file"})
      EXPECT_EQ(bytes.find(key), std::string::npos) << name << ": turned once read, they would lie";
    const auto export_from_file = matrix_of_json(about->at("export_from_file"));
    const auto world_from_export = matrix_of_json(about->at("world_from_export"));
    ASSERT_TRUE(export_from_file && world_from_export);
    const Eigen::Vector3d in_file = glb ? Eigen::Vector3d(0, 2, 0) : Eigen::Vector3d(0, 0, 2);
    const Eigen::Vector4d world = *world_from_export * *export_from_file * in_file.homogeneous();
    EXPECT_NEAR((world.head<3>() - e.surface.mesh.vertices.positions[1]).norm(), 0, 1e-9) << name;
  }
}

TEST(SurfaceFiles, OnlyAnExportThatNobodyTouchedIsWrittenOver) {
  const fs::path file = scratch() / "a.ply", beside = file.string() + ".json";
  EXPECT_FALSE(holds_other_work(file));
  const Exported e = exported();
  ASSERT_TRUE(write_surface(file, e.run, e.surface, {}, {}));
  EXPECT_FALSE(holds_other_work(file));
  const std::string about = *read_file(beside);
  test::put(file, *read_file(file) + " ");
  EXPECT_TRUE(holds_other_work(file)) << "it was worked on";
  fs::remove(file);
  EXPECT_FALSE(holds_other_work(file));
  for (const char* other : {"{}", "[1]", "a note", R"({"world_from_export": 1, "file_hash": 5})"}) {
    test::put(beside, other);
    test::put(file, "a user's");
    EXPECT_TRUE(holds_other_work(file)) << other;
  }
  fs::remove(beside);
  EXPECT_TRUE(holds_other_work(file));
}

TEST(SurfaceFiles, WithoutScaleThatIsSaid) {
  const fs::path file = scratch() / "a.ply";
  const Exported e = exported();
  const auto frame = export_frame(Eigen::Vector3d::Zero(), std::nullopt);
  ASSERT_TRUE(frame);
  ASSERT_TRUE(write_surface(file, e.run, e.surface, *frame, {}));
  const auto about = stages::read_json(file.string() + ".json");
  EXPECT_EQ(about->at("unit"), "scene");
  EXPECT_FALSE(about->contains("scale"));
  EXPECT_THAT(*read_file(file), HasSubstr("no scale is known"));
}

TEST(SurfaceFiles, FlavoursNameTheTemperature) {
  const fs::path file = scratch() / "a.ply";
  const Exported e = exported();
  FileOptions options;
  options.temperature_name = "scalar_temperature";
  options.points = true;
  ASSERT_TRUE(write_surface(file, e.run, e.surface, {}, options));
  const auto bytes = read_file(file);
  EXPECT_THAT(*bytes, HasSubstr("property float scalar_temperature\n"));
  EXPECT_THAT(*bytes, ::testing::Not(HasSubstr("element face")));
}

TEST(SurfaceFiles, PaletteColoursAndGrayForNone) {
  const fs::path file = scratch() / "a.ply";
  Exported e = exported();
  FileOptions options;
  options.colors = VertexColors::temperature;
  options.palette = "white-hot";
  ASSERT_TRUE(write_surface(file, e.run, e.surface, {}, options));
  const auto cloud = read_ply(file);
  EXPECT_EQ(cloud->colors[1], (std::array<std::uint8_t, 3>{255, 255, 255}));
  EXPECT_EQ(cloud->colors[2], (std::array<std::uint8_t, 3>{128, 128, 128}));
  EXPECT_EQ(cloud->colors[3], (std::array<std::uint8_t, 3>{0, 0, 0}));
  e.surface.mesh.vertices.temperatures_k.clear();
  EXPECT_EQ(write_surface(file, e.run, e.surface, {}, options).error().kind, ErrorKind::usage);
}

TEST(SurfaceFiles, OtherNamesAndDirectionsAreRefused) {
  for (const char* name : {"a.stl", "a", "", ".glb"}) EXPECT_FALSE(check_extension(name)) << name;
  EXPECT_TRUE(check_extension("a.GLB"));
  for (const Eigen::Vector3d& up : {Eigen::Vector3d(std::nan(""), 0, 1),
                                    Eigen::Vector3d(1e300, 0, 0), Eigen::Vector3d(1e-30, 0, 0)})
    EXPECT_FALSE(export_frame(up, std::nullopt));
  const auto down = export_frame({0, 0, -1}, std::nullopt);
  ASSERT_TRUE(down);
  EXPECT_NEAR((down->export_from_world * Eigen::Vector3d(0, 0, -1)).z(), 1, 1e-12);
}

}  // namespace
}  // namespace orbitfuse::exporting
