// SPDX-License-Identifier: BSD-3-Clause
// bench_rig_pairs SCENE...: the test pairs of the rendered scenes, where both modalities share one
// camera, as a rig whose transform nobody knows: error of the transform and the lens, and by how
// much corners and centre of the thermal image are misplaced. With the pairs shuffled it must
// refuse, and so with the frames of the two orbits in their order.

#include <fmt/format.h>
#include <cstdio>
#include <filesystem>

#include "core/formats/ground_truth.hpp"
#include "core/image/image_io.hpp"
#include "core/system/clock.hpp"
#include "core/system/cpu.hpp"
#include "recon/alignment/luminance.hpp"
#include "recon/poses/rig/rig_estimate.hpp"
#include "tests/support/shared_data.hpp"

namespace {

using namespace orbitfuse;
namespace fs = std::filesystem;

struct TestPairs {
  std::vector<RigView> views;
  Camera camera;
};

Result<TestPairs> read(const fs::path& folder) {
  ORBITFUSE_ASSIGN(const GroundTruth truth, read_ground_truth(folder / "ground_truth.json"));
  if (truth.test.empty())
    return fail(ErrorKind::input, folder.string(), "no test views in its truth", "name another");
  TestPairs pairs;
  pairs.camera = truth.test.front().camera;
  Session session;
  session.folder = folder;
  const auto relative = [&](const fs::path& file) {
    return file.lexically_relative(folder).string();
  };
  for (const TrueTestView& pair : truth.test) {
    RigView view;
    FrameRecord frame;
    frame.width = pairs.camera.width, frame.height = pairs.camera.height;
    frame.file = view.name = relative(pair.visible);
    ORBITFUSE_ASSIGN(view.visible, read_luminance(session, frame));
    frame.file = relative(pair.thermal);
    frame.modality = Modality::thermal;
    ORBITFUSE_ASSIGN(view.thermal, read_luminance(session, frame));
    view.visible_camera = pairs.camera;
    pairs.views.push_back(std::move(view));
  }
  return pairs;
}

/// Both orbits' frames by their order, as a folder of equal names would pair them: no rig.
Result<TestPairs> orbits_as_pairs(const fs::path& folder) {
  ORBITFUSE_ASSIGN(const GroundTruth truth, read_ground_truth(folder / "ground_truth.json"));
  TestPairs pairs;
  Session session;
  session.folder = folder;
  const auto& visible = truth.views.at(Modality::visible);
  const auto& thermal = truth.views.at(Modality::thermal);
  for (std::size_t i = 0; i < std::min(visible.size(), thermal.size()); ++i) {
    RigView view;
    FrameRecord frame;
    frame.file = view.name = visible[i].name;
    frame.width = visible[i].camera.width, frame.height = visible[i].camera.height;
    ORBITFUSE_ASSIGN(view.visible, read_luminance(session, frame));
    view.visible_camera = visible[i].camera;
    pairs.camera = thermal[i].camera;
    frame.file = thermal[i].name;
    frame.width = pairs.camera.width, frame.height = pairs.camera.height;
    frame.modality = Modality::thermal;
    ORBITFUSE_ASSIGN(view.thermal, read_luminance(session, frame));
    pairs.views.push_back(std::move(view));
  }
  return pairs;
}

/// Pixels by which the rig misplaces far points, over a grid of the image.
double mean_misplacement_px(const RigEstimate& rig, const Camera& camera) {
  double sum = 0;
  int count = 0;
  for (int y = 0; y <= 4; ++y)
    for (int x = 0; x <= 4; ++x) {
      const Eigen::Vector2d pixel(x * camera.width / 4.0, y * camera.height / 4.0);
      sum += (rig.thermal.project(rig.thermal_from_visible * camera.ray_of(pixel)) - pixel).norm();
      ++count;
    }
  return sum / count;
}

void print(const char* what, const TestPairs& pairs, double focal_error, double sigma) {
  RigOptions options;
  options.thermal_lens = pairs.camera;
  options.thermal_lens.fx = options.thermal_lens.fy = pairs.camera.fx * (1 + focal_error);
  options.focal_relative_sigma = sigma;
  const double before = cpu_seconds();
  const auto rig = estimate_rig(pairs.views, options, {});
  const double spent = cpu_seconds() - before;
  if (!rig) {
    fmt::print("  {}: refused: {}; {:.1f} CPU s\n", what, rig.error().found, spent);
    return;
  }
  fmt::print(
      "  {}: off by {:.2f} deg, focal length by {:.2f} %, {:.2f} px in the mean; {}; {:.1f} CPU "
      "s\n",
      what, Eigen::AngleAxisd(rig->thermal_from_visible.rotation).angle() * 180 / EIGEN_PI,
      100 * (rig->thermal.fx / pairs.camera.fx - 1), mean_misplacement_px(*rig, pairs.camera),
      rig->words(), spent);
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const fs::path data = testing::shared_data();
  if (argc < 2 || !fs::exists(data)) {
    std::fputs("bench_rig_pairs SCENE...; needs the shared data (ORBITFUSE_SHARED)\n", stderr);
    return 2;
  }
  fmt::print("{}\n", cpu_description());
  for (int i = 1; i < argc; ++i) {
    fmt::print("{}\n", argv[i]);
    auto pairs = read(data / "orbits" / argv[i]);
    if (pairs) {
      print("focal length 5 % too long", *pairs, 0.05, 0.05);
      print("focal length unknown", *pairs, 0.3, 0.3);
      const cv::Mat first = pairs->views.front().thermal;
      for (std::size_t v = 0; v + 1 < pairs->views.size(); ++v)
        pairs->views[v].thermal = pairs->views[v + 1].thermal;
      pairs->views.back().thermal = first;
      print("shuffled", *pairs, 0.05, 0.05);
    } else {
      fmt::print("  no rig: {}\n", pairs.error().message());
    }
    if (const auto orbits = orbits_as_pairs(data / "orbits" / argv[i]))
      print("two orbits by one counter", *orbits, 0.03, 0.03);
    else
      fmt::print("  {}\n", orbits.error().message());
  }
  return 0;
}
