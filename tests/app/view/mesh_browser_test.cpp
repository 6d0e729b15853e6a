// SPDX-License-Identifier: BSD-3-Clause
#include <atomic>
#include <chrono>
#include <thread>

#include "tests/app/view/view_browser_fixture.hpp"

namespace orbitfuse::view {
namespace {

/// Points until the mesh is made; then the mesh, without a reload, in the colours of every layer.
TEST_F(ViewBrowserTest, TheMeshComesInThePointsPlace) {
  std::atomic<bool> held{true};
  serve([&](const FinishedRun& run, const Progress& progress) {
    while (held && !progress.cancelled())
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return exporting::viewer_surface(run, progress);
  });
  orbitfuse::test::Browser page(folder.path() / "profile", 1280, 800, false);
  page.open(url);
  ASSERT_TRUE(page.becomes("viewer.surface.points")) << page.evaluate("$('hint').textContent");
  ASSERT_TRUE(page.becomes("$('surface-words').textContent.includes('being made')"));
  EXPECT_EQ(page.evaluate("viewer.surface.points.visible"), true);
  EXPECT_EQ(page.evaluate("viewer.surface.meshAt(.5, .5)"), nullptr);
  held = false;
  ASSERT_TRUE(page.becomes("viewer.surface.mesh")) << page.evaluate("$('hint').textContent");
  EXPECT_EQ(page.evaluate("$('surface-words').textContent"), "");
  EXPECT_EQ(page.evaluate("viewer.surface.points.visible"), false);
  const auto corners = page.evaluate("viewer.surface.mesh.geometry.index.count").get<int>();
  EXPECT_GT(corners, 300);
  EXPECT_LE(corners, 3 * exporting::viewer_triangles);
  EXPECT_TRUE(fs::exists(out / exporting::viewer_surface_file));

  page.evaluate("$('show-visible').click(); $('show-thermal').click()");
  const cv::Rect middle(440, 200, 400, 400);
  // As while the camera moves: nothing is rendered.
  const auto moving = [&](const std::string& layer, const std::string& name) {
    page.evaluate("document.querySelector('[data-value=" + layer + "]').click()");
    page.evaluate("viewer.rest.moved(); clearTimeout(viewer.rest.timer); viewer.rest.timer = 0");
    EXPECT_TRUE(page.becomes("!$('rest').classList.contains('shown')"));
    page.evaluate("new Promise(done => setTimeout(done, 300))");
    return kept(name, page.screenshot());
  };
  const cv::Mat visible = moving("visible", "mesh_visible");
  EXPECT_GT(lit_share(visible, middle), 0.2);
  const cv::Mat thermal = moving("thermal", "mesh_thermal");
  EXPECT_GT(difference(visible, thermal, middle), 20);
  const cv::Mat mix = moving("mix", "mesh_mix");
  EXPECT_GT(difference(mix, visible, middle), 10);
  EXPECT_GT(difference(mix, thermal, middle), 10);
  moving("thermal", "mesh_thermal");
  page.evaluate("$('palette').value = 'rainbow'; $('palette').onchange()");
  const cv::Mat rainbow = moving("thermal", "mesh_rainbow");
  EXPECT_GT(difference(rainbow, thermal, middle), 20);
  page.evaluate("$('low').value = $('high').value; $('low').oninput()");
  EXPECT_GT(difference(moving("thermal", "mesh_span"), rainbow, middle), 20);

  // A machine that draws it slowly turns a coarser one; at rest the whole is drawn.
  const auto drawn = [&](const std::string& while_moving) {
    return page.evaluate(
        "new Promise(done => { const s = viewer.surface; s.moving = " + while_moving +
        "; s.keepPace = () => {}; s.draw(); requestAnimationFrame(() => requestAnimationFrame(() "
        "=> "
        "done([s.mesh.visible, s.coarse.visible]))); })");
  };
  EXPECT_EQ(page.evaluate("viewer.surface.keepPace(100), viewer.surface.share < 1 || "
                          "viewer.surface.mesh.geometry.index.count === "
                          "viewer.surface.coarse.geometry.index.count"),
            true);
  page.evaluate("viewer.surface.share = 0.5");
  EXPECT_EQ(drawn("true").dump(), "[false,true]");
  EXPECT_EQ(drawn("false").dump(), "[true,false]");
  page.evaluate(
      "delete viewer.surface.keepPace; viewer.surface.keepPace(0.1), viewer.surface.moves()");
  EXPECT_EQ(page.evaluate("viewer.surface.share"), 1);

  // What is touched is the mesh: nobody is asked where the surface is.
  page.evaluate("viewer.rest.moved()");
  ASSERT_TRUE(rests(page));
  page.evaluate(
      "window.asked = []; window.fetch = (f => (path, ...more) => { asked.push(path); return "
      "f(path, ...more); })(fetch)");
  page.evaluate("document.querySelector('[data-value=spot]').click()");
  page.press(640, 400);
  ASSERT_TRUE(page.becomes("viewer.measuring.list.length === 1"))
      << page.evaluate("$('measure-words').textContent");
  EXPECT_EQ(page.evaluate("asked.includes('/pick')"), false);
  EXPECT_GT(page.evaluate("viewer.measuring.list[0].answer.reading.frame_count").get<int>(), 0);
  EXPECT_EQ(page.evaluate("viewer.measuring.list[0].request.places[0].point"),
            page.evaluate("viewer.surface.meshAt(.5, .5)"));
  EXPECT_TRUE(page.errors().empty()) << page.errors().front();
}

TEST_F(ViewBrowserTest, WithoutAMeshThePointsStayAndItSaysWhy) {
  serve([](const FinishedRun&, const Progress&) -> Result<std::string> {
    return fail(ErrorKind::quality, "surface", "only loose pieces", "choose a larger box");
  });
  orbitfuse::test::Browser page(folder.path() / "profile", 1280, 800, false);
  page.open(url);
  ASSERT_TRUE(page.becomes("$('surface-words').textContent.includes('only loose pieces')"));
  EXPECT_EQ(page.evaluate("$('surface-words').className"), "warning");
  EXPECT_EQ(page.evaluate("viewer.surface.points.visible"), true);
  ASSERT_TRUE(rests(page));
}

}  // namespace
}  // namespace orbitfuse::view
