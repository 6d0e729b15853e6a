// SPDX-License-Identifier: BSD-3-Clause
// What is exported, in other people's programs: three.js in a browser, Blender, CloudCompare,
// MeshLab.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "app/export/glb.hpp"
#include "core/formats/ply.hpp"
#include "core/system/file_io.hpp"
#include "tests/support/browser.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::exporting {
namespace {
namespace fs = std::filesystem;

/// A hill of a green side and a red one, 280 to 320 K, one vertex without temperature.
TriangleMesh hill() {
  TriangleMesh mesh;
  constexpr std::uint32_t side = 40;
  for (std::uint32_t j = 0; j < side; ++j)
    for (std::uint32_t i = 0; i < side; ++i) {
      const double x = 0.05 * i - 1, y = 0.05 * j - 1;
      mesh.vertices.positions.emplace_back(x, y, std::exp(-3 * (x * x + y * y)));
      mesh.vertices.normals.emplace_back(0, 0, 1);
      mesh.vertices.colors.push_back(i < side / 2 ? std::array<std::uint8_t, 3>{20, 200, 20}
                                                  : std::array<std::uint8_t, 3>{220, 30, 30});
      mesh.vertices.temperatures_k.push_back(280 + 40 * static_cast<float>(i) / (side - 1));
      // Colours of many shades, so that a reader that drops them is found out.
      mesh.vertices.colors.back()[2] = static_cast<std::uint8_t>(6 * j);
      if (i == 0 || j == 0) continue;
      const std::uint32_t v = j * side + i;
      mesh.triangles.push_back({v - side - 1, v - side, v});
      mesh.triangles.push_back({v - side - 1, v, v - 1});
    }
  mesh.vertices.temperatures_k[5] = std::nanf("");
  return mesh;
}

bool has_program(const char* name) {
  return std::system(("command -v " + std::string(name) + " > /dev/null").c_str()) == 0;
}

std::string base64(const std::string& bytes) {
  static const char* const letters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      out += i + k <= bytes.size() ? letters[group >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

TEST(OtherTools, ThreeJsShowsTheGlb) {
  if (!orbitfuse::test::Browser::is_here()) GTEST_SKIP() << "chromium is not installed";
  const fs::path three = "/usr/share/javascript/three";
  const auto library = read_file(three / "three.min.js"),
             loader = read_file(three / "examples/js/loaders/GLTFLoader.js");
  if (!library || !loader) GTEST_SKIP() << "libjs-three is not installed";
  const orbitfuse::test::TempFolder folder;
  // ORBITFUSE_EXPORT_GLB: another file to look at, e.g. of a van.
  fs::path file = folder.path() / "hill.glb";
  if (const char* given = std::getenv("ORBITFUSE_EXPORT_GLB"))
    file = given;
  else
    ASSERT_TRUE(write_glb(file, hill(), {{"unit", "metre"}}));
  const auto glb = read_file(file);
  ASSERT_TRUE(glb);
  const std::string page = "<!doctype html><body style='margin:0;background:#000'><script>" +
                           *library + "</script>" + "<script>" + *loader + "</script><script>\n" +
                           "const bytes = Uint8Array.from(atob('" + base64(*glb) +
                           R"('), c => c.charCodeAt(0));
const renderer = new THREE.WebGLRenderer({preserveDrawingBuffer: true});
renderer.setSize(400, 300);
document.body.appendChild(renderer.domElement);
new THREE.GLTFLoader().parse(bytes.buffer, '', gltf => {
  const scene = new THREE.Scene();
  scene.add(gltf.scene);
  gltf.scene.traverse(o => { if (o.isMesh) window.shape = o; });
  const box = new THREE.Box3().setFromObject(gltf.scene);
  const middle = box.getCenter(new THREE.Vector3()), size = box.getSize(new THREE.Vector3());
  const camera = new THREE.PerspectiveCamera(50, 4 / 3, 0.01, 1000);
  camera.position.copy(middle).add(new THREE.Vector3(0, size.y + size.length(), 0.6 * size.length()));
  camera.lookAt(middle);
  renderer.render(scene, camera);
  window.height = size.y;
  window.done = true;
}, error => { window.failed = String(error); });
</script>)";
  ASSERT_TRUE(write_file_atomic(folder.path() / "page.html", page));
  orbitfuse::test::Browser browser(folder.path() / "profile", 400, 300, false);
  browser.open("file://" + (folder.path() / "page.html").string());
  ASSERT_TRUE(browser.becomes("window.done === true || window.failed !== undefined"));
  ASSERT_EQ(browser.evaluate("window.failed || ''"), "");
  // three.js lower-cases attributes of one's own.
  const auto names = browser.evaluate("Object.keys(shape.geometry.attributes).join(' ')");
  EXPECT_NE(names.get<std::string>().find("_temperature"), std::string::npos) << names;
  const auto hottest = browser.evaluate(
      "Math.max(...Array.from(shape.geometry.attributes._temperature.array.slice(0, 1600)))");
  EXPECT_GT(hottest.get<double>(), 250);
  EXPECT_LT(hottest.get<double>(), 2000);
  const cv::Mat picture = browser.screenshot();
  int lit = 0, red = 0, green = 0;
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x) {
      const auto p = picture.at<cv::Vec3b>(y, x);
      lit += p[0] + p[1] + p[2] > 60;
      green += p[1] > p[2] + 60;
      red += p[2] > p[1] + 60;
    }
  EXPECT_GT(lit, picture.rows * picture.cols / 50);
  if (std::getenv("ORBITFUSE_EXPORT_GLB") == nullptr) {
    EXPECT_GT(red, 2000);
    EXPECT_GT(green, 2000);
    EXPECT_NEAR(browser.evaluate("window.height").get<double>(), 1, 0.02);  // y is up
  }
}

TEST(OtherTools, BlenderReadsTheGlb) {
  if (!has_program("blender")) GTEST_SKIP() << "blender is not installed";
  const orbitfuse::test::TempFolder folder;
  nlohmann::json extras = {{"unit", "metre"}};
  extras["box"] = {{"low", {-1, -1, hill().vertices.positions[0].z()}}, {"high", {0.95, 0.95, 1}}};
  ASSERT_TRUE(write_glb(folder.path() / "hill.glb", hill(), extras));
  const std::string command = "blender -b --python-exit-code 1 -P " ORBITFUSE_SOURCE_DIR
                              "/tests/app/export/glb_in_blender.py -- " +
                              (folder.path() / "hill.glb").string() + " > " +
                              (folder.path() / "log").string() + " 2>&1";
  const int code = std::system(command.c_str());
  EXPECT_EQ(code, 0) << read_file(folder.path() / "log").value_or("");
}

TEST(OtherTools, CloudCompareReadsTheScalar) {
  if (!has_program("CloudCompare")) GTEST_SKIP() << "cloudcompare is not installed";
  const orbitfuse::test::TempFolder folder;
  TriangleMesh cloud = hill();
  cloud.triangles.clear();
  ASSERT_TRUE(write_ply(folder.path() / "hill.ply", cloud, {"scalar_temperature", {}}));
  const std::string command =
      "cd " + folder.path().string() +
      " && QT_QPA_PLATFORM=offscreen CloudCompare -SILENT -NO_TIMESTAMP -C_EXPORT_FMT ASC "
      "-ADD_HEADER -PREC 8 -O hill.ply -SAVE_CLOUDS FILE out.asc > log 2>&1";
  ASSERT_EQ(std::system(command.c_str()), 0) << read_file(folder.path() / "log").value_or("");
  std::ifstream table(folder.path() / "out.asc");
  std::string line;
  std::getline(table, line);
  ASSERT_EQ(line.rfind("//X Y Z R G B temperature", 0), 0U) << line;
  std::size_t row = 0;
  for (; std::getline(table, line); ++row) {
    std::istringstream words(line);
    std::string x, y, z, r, g, b, kelvin;
    words >> x >> y >> z >> r >> g >> b >> kelvin;
    const float wanted = cloud.vertices.temperatures_k.at(row);
    if (std::isnan(wanted))
      EXPECT_EQ(kelvin, "nan");
    else
      ASSERT_NEAR(std::stof(kelvin), wanted, 1e-3) << row;
    ASSERT_NEAR(std::stod(x), cloud.vertices.positions[row].x(), 1e-6);
  }
  EXPECT_EQ(row, cloud.vertices.size());
}

/// MeshLab's own script drops what is colder than 300 K by `q`, its scalar of a vertex: what is
/// left and what is written again shows that it read the temperatures as such.
TEST(OtherTools, MeshLabReadsTheQuality) {
  if (!has_program("meshlabserver") || !has_program("xvfb-run"))
    GTEST_SKIP() << "meshlab and xvfb are not installed";
  const orbitfuse::test::TempFolder folder;
  const TriangleMesh mesh = hill();
  ASSERT_TRUE(write_ply(folder.path() / "hill.ply", mesh, {"quality", {}}));
  ASSERT_TRUE(write_file_atomic(
      folder.path() / "warm.mlx",
      "<!DOCTYPE FilterScript><FilterScript><filter name=\"Conditional Vertex Selection\">"
      "<Param type=\"RichString\" name=\"condSelect\" value=\"(q &lt; 300)\"/></filter>"
      "<filter name=\"Delete Selected Vertices\"/></FilterScript>"));
  // Without a screen it needs OpenGL, from Mesa and a virtual one.
  const std::string command =
      "cd " + folder.path().string() +
      " && LIBGL_ALWAYS_SOFTWARE=1 xvfb-run -a -s '-screen 0 640x480x24' meshlabserver -i hill.ply "
      "-s warm.mlx -o out.ply -m vq > log 2>&1";
  ASSERT_EQ(std::system(command.c_str()), 0) << read_file(folder.path() / "log").value_or("");
  std::string written = read_file(folder.path() / "out.ply").value_or("");
  const std::string scalar = "property float quality";
  const std::size_t at = written.find(scalar);
  ASSERT_NE(at, std::string::npos) << read_file(folder.path() / "log").value_or("");
  written.replace(at, scalar.size(), "property float temperature");
  ASSERT_TRUE(write_file_atomic(folder.path() / "ours.ply", written));
  const auto read = read_ply(folder.path() / "ours.ply");
  ASSERT_TRUE(read) << read.error().message();
  std::size_t row = 0;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const float wanted = mesh.vertices.temperatures_k[i];
    if (wanted < 300) continue;
    ASSERT_LT(row, read->size());
    ASSERT_LT((read->positions[row] - mesh.vertices.positions[i]).norm(), 1e-6) << i;
    if (std::isnan(wanted))
      EXPECT_TRUE(std::isnan(read->temperatures_k[row]));
    else
      ASSERT_EQ(read->temperatures_k[row], wanted) << i;
    ++row;
  }
  EXPECT_EQ(row, read->size());
  EXPECT_LT(row, mesh.vertices.size());
}

}  // namespace
}  // namespace orbitfuse::exporting
