// SPDX-License-Identifier: BSD-3-Clause
// How soon the viewer of a finished run shows its pictures, in a browser without a screen.
//   viewer_speed RUN [--views 6] [--layer fused] [--rendering]
// RUN: --out folder of `orbitfuse run`. Chromium draws by software on the same cores. Wall times
// mean something on an idle machine only; CPU seconds always, so first come those of rendering
// alone (and no others with --rendering), and how far its pictures are from those of four times as
// many samples.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "app/export/viewer_surface.hpp"
#include "app/view/layers.hpp"
#include "app/view/view_server.hpp"
#include "core/numeric/median.hpp"
#include "core/system/clock.hpp"
#include "core/system/cpu.hpp"
#include "core/system/parallel.hpp"
#include "tests/support/browser.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

/// Milliseconds from the end of a movement to the first picture, the first at full size, the first
/// with temperatures at full size, and the last, which has the detail of recorded frames.
constexpr const char* timed_rest = R"((async () => {
  const s = viewer.surface, p = s.pose(), up = new THREE.Vector3(...viewer.scene.up);
  const away = new THREE.Vector3(...p.position).sub(new THREE.Vector3(...p.target));
  const times = {}, size = viewer.rest.size(1);
  const done = new Promise(whole => viewer.onPicture.push(() => {
    const r = viewer.rest, now = performance.now();
    if (!(r.level >= 0)) return;
    if (!times.first) times.first = now;
    if (!times.full && r.width === size[0]) times.full = now;
    if (!times.own && r.width === size[0] && r.pictures.thermal && r.pictures.thermal.width === size[0]) times.own = now;
    if (r.finished && !times.whole) { times.whole = now; whole(); }
  }));
  const begun = performance.now();
  s.stand({ ...p, position: away.applyAxisAngle(up, 0.7).add(new THREE.Vector3(...p.target)).toArray() });
  await done;
  viewer.onPicture.pop();
  return [times.first - begun, times.full - begun, (times.own || times.whole) - begun, times.whole - begun, size[0], size[1]];
})())";

/// The same to the first picture after a drag by the left button, whose release is the rest.
constexpr const char* armed_for_a_drag = R"((() => {
  window.dragged = {};
  $("surface").addEventListener("pointerup", () => { dragged.begun = performance.now(); }, { once: true, capture: true });
  const seen = () => { if (dragged.begun && !dragged.first && viewer.rest.level >= 0) dragged.first = performance.now(); };
  viewer.onPicture.push(seen);
})())";
constexpr const char* time_of_the_drag = "viewer.onPicture.pop(), dragged.first - dragged.begun";

/// Pictures a second while the camera turns for three seconds, all of them drawn by then.
constexpr const char* timed_turn = R"(new Promise(done => {
  const s = viewer.surface, p = s.pose(), up = new THREE.Vector3(...viewer.scene.up), target = new THREE.Vector3(...p.target);
  const away = new THREE.Vector3(...p.position).sub(target), begun = performance.now();
  let drawn = 0;
  const turn = () => {
    const t = (performance.now() - begun) / 1000;
    if (t > 3) {
      const gl = s.renderer.getContext();
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
      return done([1000 * drawn / (performance.now() - begun)]);
    }
    ++drawn;
    s.camera.position.copy(away).applyAxisAngle(up, t).add(target);
    s.controls.update();
    requestAnimationFrame(turn);
  };
  requestAnimationFrame(turn);
}))";

/// Where recorded cameras stood, at 640x480 and the page's field of view.
std::vector<view::Shot> shots_of(const view::FinishedRun& run, int views) {
  constexpr double page_horizontal_fov_deg = 57.8;  // 45 upright
  std::vector<Rigid3d> poses;
  for (const view::RecordedView& recorded : run.views)
    if (recorded.modality == run.frame) poses.push_back(recorded.view.cam_from_world);
  const std::size_t count = std::min(poses.size(), static_cast<std::size_t>(views));
  std::vector<view::Shot> shots;
  for (std::size_t i = 0; i < count; ++i)
    shots.push_back(
        {Camera::from_fov(640, 480, page_horizontal_fov_deg), poses[i * poses.size() / count]});
  return shots;
}

/// CPU and wall seconds of rendering, without a browser, up to each picture that the page asks for
/// (RestingView.steps in app/view/web/layers.js).
void report_rendering(const view::FinishedRun& run, int views) {
  struct Step {
    const char* words;
    view::LayerWish wish;
  };
  const bool visible_alone = !run.has(Modality::thermal);  // else the fused one is shown
  const auto step = [&](const char* words, int divisor, int thermal_divisor, bool detail) {
    return Step{words,
                {.visible = visible_alone,
                 .divisor = divisor,
                 .thermal_divisor = thermal_divisor,
                 .detail = detail}};
  };
  const std::vector<Step> steps = {step("first picture", 8, 8, false), step("second", 5, 5, false),
                                   step("full size, coarse temperatures", 1, 5, false),
                                   step("full temperatures", 1, 1, false),
                                   step("detail of recorded frames", 1, 1, true)};
  view::LayerRenderer renderer(run);
  view::RenderTurns turns;
  std::vector<std::vector<double>> cpu_s(steps.size()), wall_s(steps.size());
  for (const view::Shot& shot : shots_of(run, views)) {
    view::RenderTurns::Job job(turns, "bench", nullptr);
    const UsageClock clock;
    for (std::size_t s = 0; s < steps.size(); ++s) {
      const auto seen = renderer.render(shot, steps[s].wish, job);
      if (!seen) fmt::print(stderr, "{}\n", seen.error().message());
      cpu_s[s].push_back(clock.cpu_s());
      wall_s[s].push_back(clock.wall_s());
    }
  }
  if (cpu_s[0].empty()) return;
  fmt::print(
      "Rendering alone, 640x480, median of {} views, from rest on:\n\n"
      "| picture | CPU s | wall s | cores |\n|---|---|---|---|\n",
      cpu_s[0].size());
  for (std::size_t s = 0; s < steps.size(); ++s) {
    const double cpu = median(cpu_s[s]), wall = median(wall_s[s]);
    fmt::print("| {} | {:.3f} | {:.3f} | {:.2f} |\n", steps[s].words, cpu, wall, cpu / wall);
  }
  fmt::print("\n");
}

/// Absolute differences of the values that both have.
void add_differences(const cv::Mat& quick, const cv::Mat& exact, std::vector<double>& all) {
  cv::Mat a, b;
  quick.reshape(1).convertTo(a, CV_32F);
  exact.reshape(1).convertTo(b, CV_32F);
  for (int y = 0; y < a.rows; ++y)
    for (int x = 0; x < a.cols; ++x) {
      const double off = std::abs(a.at<float>(y, x) - b.at<float>(y, x));
      if (std::isfinite(off)) all.push_back(off);
    }
}

/// Pictures that are waited for, and those whose every pixel is rendered, against the same with
/// four times as many samples a ray.
Status report_differences(view::FinishedRun& run, int views) {
  const nerf::RenderOptions usual = run.config.render.visible;
  nerf::RenderOptions fine = usual;
  fine.sample_factor = 4;
  view::RenderTurns turns;
  view::RenderTurns::Job job(turns, "bench", nullptr);
  std::vector<double> visible[2], thermal[2];  // quick, exact
  for (const view::Shot& shot : shots_of(run, views)) {
    const auto shown = [&](const nerf::RenderOptions& quality, bool every_pixel) {
      run.config.render.visible = quality;
      auto seen =
          view::LayerRenderer(run).render(shot, {.fused = false, .every_pixel = every_pixel}, job);
      run.config.render.visible = usual;
      return seen;
    };
    ORBITFUSE_ASSIGN(const view::Layers truth, shown(fine, true));
    for (const bool exact : {false, true}) {
      ORBITFUSE_ASSIGN(const view::Layers seen, shown(usual, exact));
      if (!seen.visible.empty()) add_differences(seen.visible, truth.visible, visible[exact]);
      if (!seen.kelvin.empty()) add_differences(seen.kelvin, truth.kelvin, thermal[exact]);
    }
  }
  fmt::print("| off four times the samples | mean | 99 % | 99.9 % |\n|---|---|---|---|\n");
  for (const bool exact : {false, true})
    for (auto& [words, all] :
         {std::pair{"visible, of 255", &visible[exact]}, {"thermal, K", &thermal[exact]}}) {
      if (all->empty()) continue;
      double sum = 0;
      for (const double off : *all) sum += off;
      fmt::print("| {}, {} | {:.3f} | {:.2f} | {:.2f} |\n", words,
                 exact ? "every pixel" : "as it is waited for",
                 sum / static_cast<double>(all->size()), quantile(*all, 0.99),
                 quantile(*all, 0.999));
    }
  fmt::print("\n");
  return {};
}

int report(const std::string& out, int views, const std::string& layer, bool rendering_only) {
  auto run = view::load_finished_run(out, stages::RunConfig(), {});
  if (!run) {
    fmt::print(stderr, "{}\n", run.error().message());
    return 3;
  }
  report_rendering(*run, views);
  if (const Status told = report_differences(*run, std::min(views, 4)); !told)
    fmt::print(stderr, "{}\n", told.error().message());
  if (rendering_only) return 0;
  PageOptions options;
  options.port = 0;
  view::ViewServer server(*std::move(run), options, exporting::viewer_surface);
  if (const Status started = server.start(); !started) {
    fmt::print(stderr, "{}\n", started.error().message());
    return 4;
  }
  const test::TempFolder folder;
  test::Browser page(folder.path() / "profile", 1024, 768, false);
  page.open(server.urls().front());
  const std::string rests = "viewer.surface.mesh && viewer.rest.finished";
  if (!page.becomes(rests)) return 5;
  page.evaluate("document.querySelector('#layers [data-value=" + layer + "]').click()");
  if (!page.becomes(rests)) return 5;
  std::vector<double> first, released, full, own, whole, rate, cpu_s;
  nlohmann::json last;
  for (int i = 0; i < views; ++i) {
    const UsageClock spent;
    last = page.evaluate(timed_rest);
    cpu_s.push_back(spent.cpu_s());
    first.push_back(last[0].get<double>());
    full.push_back(last[1].get<double>());
    own.push_back(last[2].get<double>());
    whole.push_back(last[3].get<double>());
    page.evaluate(armed_for_a_drag);
    page.drag(500, 400, 560, 410);
    if (!page.becomes("dragged.first && viewer.rest.finished")) return 5;
    released.push_back(page.evaluate(time_of_the_drag).get<double>());
    rate.push_back(page.evaluate(timed_turn)[0].get<double>());
    if (!page.becomes(rests)) return 5;
  }
  fmt::print(
      "{}, {} threads; {}, layer {}, {} views: median (most)\n\n"
      "| first picture ms | after a drag ms | {}x{} s, coarse temperatures | full temperatures s | "
      "with detail s | CPU s of the server | pictures a second while moving |\n"
      "|---|---|---|---|---|---|---|\n",
      cpu_description(), thread_count(), out, layer, views, last[4].get<int>(), last[5].get<int>());
  const auto most = [](const std::vector<double>& v) {
    return *std::max_element(v.begin(), v.end());
  };
  fmt::print(
      "| {:.0f} ({:.0f}) | {:.0f} ({:.0f}) | {:.2f} ({:.2f}) | {:.2f} ({:.2f}) | {:.2f} ({:.2f}) | "
      "{:.2f} | {:.0f} (least {:.0f}) |\n",
      median(first), most(first), median(released), most(released), median(full) / 1e3,
      most(full) / 1e3, median(own) / 1e3, most(own) / 1e3, median(whole) / 1e3, most(whole) / 1e3,
      median(cpu_s), median(rate), *std::min_element(rate.begin(), rate.end()));
  return 0;
}

}  // namespace
}  // namespace orbitfuse

int main(int argc, char** argv) {
  CLI::App app("How soon the viewer of a finished run shows its pictures");
  std::string out, layer = "fused";
  int views = 6;
  app.add_option("run", out, "The --out folder of a finished run")->required();
  app.add_option("--views", views)->check(CLI::Range(1, 100));
  app.add_option("--layer", layer)->check(CLI::IsMember({"visible", "thermal", "fused", "mix"}));
  bool rendering_only = false;
  app.add_flag("--rendering", rendering_only, "Without a browser");
  CLI11_PARSE(app, argc, argv);
  if (!rendering_only && !orbitfuse::test::Browser::is_here()) {
    std::fputs("chromium is not installed\n", stderr);
    return 6;
  }
  return orbitfuse::report(out, views, layer, rendering_only);
}
