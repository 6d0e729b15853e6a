// SPDX-License-Identifier: BSD-3-Clause
// How soon the viewer of a finished run shows its pictures, in a browser without a screen.
//   viewer_speed RUN [--views 6] [--layer fused]
// RUN: --out folder of `orbitfuse run`. Chromium draws by software on the same cores. Wall times
// mean something on an idle machine only; CPU seconds always, so first come those of rendering
// alone.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>

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

/// Milliseconds from the end of a movement to the first picture and to the whole one, and between
/// them to the first at full size.
constexpr const char* timed_rest = R"((async () => {
  const s = viewer.surface, p = s.pose(), up = new THREE.Vector3(...viewer.scene.up);
  const away = new THREE.Vector3(...p.position).sub(new THREE.Vector3(...p.target));
  const times = {}, size = viewer.rest.size(1);
  const done = new Promise(whole => viewer.onPicture.push(() => {
    const r = viewer.rest, now = performance.now();
    if (!(r.level >= 0)) return;
    if (!times.first) times.first = now;
    if (!times.full && r.width === size[0]) times.full = now;
    if (r.finished && !times.whole) { times.whole = now; whole(); }
  }));
  s.stand({ ...p, position: away.applyAxisAngle(up, 0.7).add(new THREE.Vector3(...p.target)).toArray() });
  const begun = performance.now();
  await done;
  viewer.onPicture.pop();
  return [times.first - begun, times.full - begun, times.whole - begun, size[0], size[1]];
})())";

/// Pictures a second while the camera turns for three seconds.
constexpr const char* timed_turn = R"(new Promise(done => {
  const s = viewer.surface, p = s.pose(), up = new THREE.Vector3(...viewer.scene.up), target = new THREE.Vector3(...p.target);
  const away = new THREE.Vector3(...p.position).sub(target), begun = performance.now();
  let drawn = 0;
  const turn = () => {
    const t = (performance.now() - begun) / 1000;
    if (t > 3) return done([drawn / t, s.share]);
    ++drawn;
    s.stand({ ...p, position: away.clone().applyAxisAngle(up, t).add(target).toArray() });
    requestAnimationFrame(turn);
  };
  requestAnimationFrame(turn);
}))";

/// CPU seconds of rendering, without a browser, up to each picture that the page asks for
/// (RestingView.steps in app/view/web/layers.js): from recorded visible poses at 640x480 and the
/// page's field of view.
void report_rendering(const view::FinishedRun& run, int views) {
  constexpr int steps[][2] = {{8, 8}, {5, 5}, {1, 5}, {1, 1}};
  constexpr double page_horizontal_fov_deg = 57.8;  // 45 upright
  view::LayerRenderer renderer(run);
  view::RenderTurns turns;
  std::vector<double> first_s, full_s, whole_s;
  int skipped = 0;
  for (const view::RecordedView& recorded : run.views) {
    if (recorded.modality != Modality::visible || skipped++ % 4 != 0) continue;
    if (static_cast<int>(first_s.size()) == views) break;
    const view::Shot shot{Camera::from_fov(640, 480, page_horizontal_fov_deg),
                          recorded.view.cam_from_world};
    view::RenderTurns::Job job(turns, "bench", nullptr);
    const UsageClock clock;
    for (const auto& [divisor, thermal_divisor] : steps) {
      const auto seen = renderer.render(shot,
                                        {.visible = false,
                                         .thermal = true,
                                         .fused = true,
                                         .divisor = divisor,
                                         .thermal_divisor = thermal_divisor},
                                        job);
      if (!seen) fmt::print(stderr, "{}\n", seen.error().message());
      if (divisor == 8) first_s.push_back(clock.cpu_s());
      if (divisor == 1 && thermal_divisor == 5) full_s.push_back(clock.cpu_s());
    }
    whole_s.push_back(clock.cpu_s());
  }
  if (first_s.empty()) return;
  fmt::print(
      "CPU s of rendering at 640x480, median of {} views: first picture {:.3f}, full size with "
      "coarse temperatures {:.2f}, whole {:.2f}\n\n",
      first_s.size(), median(first_s), median(full_s), median(whole_s));
}

int report(const std::string& out, int views, const std::string& layer) {
  auto run = view::load_finished_run(out, stages::RunConfig(), {});
  if (!run) {
    fmt::print(stderr, "{}\n", run.error().message());
    return 3;
  }
  report_rendering(*run, views);
  PageOptions options;
  options.port = 0;
  view::ViewServer server(*std::move(run), options);
  if (const Status started = server.start(); !started) {
    fmt::print(stderr, "{}\n", started.error().message());
    return 4;
  }
  const test::TempFolder folder;
  test::Browser page(folder.path() / "profile", 1024, 768, false);
  page.open(server.urls().front());
  const std::string rests = "viewer.surface.points && viewer.rest.finished";
  if (!page.becomes(rests)) return 5;
  page.evaluate("document.querySelector('#layers [data-value=" + layer + "]').click()");
  if (!page.becomes(rests)) return 5;
  std::vector<double> first, full, whole, rate, cpu_s;
  nlohmann::json last;
  double share = 0;
  for (int i = 0; i < views; ++i) {
    const UsageClock spent;
    last = page.evaluate(timed_rest);
    cpu_s.push_back(spent.cpu_s());
    first.push_back(last[0].get<double>());
    full.push_back(last[1].get<double>());
    whole.push_back(last[2].get<double>());
    const nlohmann::json turned = page.evaluate(timed_turn);
    rate.push_back(turned[0].get<double>());
    share = turned[1].get<double>();
    if (!page.becomes(rests)) return 5;
  }
  fmt::print(
      "{}, {} threads; {}, layer {}, {} views: median (most)\n\n"
      "| first picture ms | {}x{} s, coarse temperatures | whole s | CPU s of the server | "
      "pictures a second while moving "
      "| of the points |\n|---|---|---|---|---|---|\n",
      cpu_description(), thread_count(), out, layer, views, last[3].get<int>(), last[4].get<int>());
  const auto most = [](const std::vector<double>& v) {
    return *std::max_element(v.begin(), v.end());
  };
  fmt::print(
      "| {:.0f} ({:.0f}) | {:.2f} ({:.2f}) | {:.2f} ({:.2f}) | {:.2f} | {:.0f} (least {:.0f}) | "
      "{:.0f} % |\n",
      median(first), most(first), median(full) / 1e3, most(full) / 1e3, median(whole) / 1e3,
      most(whole) / 1e3, median(cpu_s), median(rate), *std::min_element(rate.begin(), rate.end()),
      100 * share);
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
  CLI11_PARSE(app, argc, argv);
  if (!orbitfuse::test::Browser::is_here()) {
    std::fputs("chromium is not installed\n", stderr);
    return 6;
  }
  return orbitfuse::report(out, views, layer);
}
