// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <atomic>

#include <nlohmann/json.hpp>

#include "capture/recording/recorder.hpp"
#include "core/image/image_codec.hpp"
#include "core/image/image_io.hpp"
#include "core/system/file_io.hpp"
#include "drivers/synthetic/orbit.hpp"
#include "drivers/synthetic/renderer.hpp"
#include "drivers/synthetic/sensor.hpp"
#include "drivers/synthetic/stations.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

Json json_of(const Camera& c) {
  Json k = {{"w", c.width}, {"h", c.height}, {"fx", c.fx},
            {"fy", c.fy},   {"cx", c.cx},    {"cy", c.cy}};
  if (c.has_distortion()) {
    k["k1"] = c.k1;
    k["k2"] = c.k2;
    k["p1"] = c.p1;
    k["p2"] = c.p2;
  }
  return k;
}

Json camera_to_world(const Rigid3d& cam_from_world) {
  const Eigen::Matrix4d m = opengl_of_cam_from_world(cam_from_world);
  Json rows = Json::array();
  for (int r = 0; r < 4; ++r) rows.push_back({m(r, 0), m(r, 1), m(r, 2), m(r, 3)});
  return rows;
}

Json orbit_truth(const SyntheticOptions& options, Modality modality) {
  const char* extension = modality == Modality::visible ? ".jpg" : ".tiff";
  Json frames = Json::array();
  int station = 0, tracking = 0;
  for (const synthetic::Exposure& e : synthetic::walk(options, modality)) {
    // The names the session writer gives, in the order of the walk.
    const std::string file =
        e.tracking ? fmt::format("{}/track_{:06}{}", name(modality), tracking++, extension)
                   : fmt::format("{}/{:06}{}", name(modality), station++, extension);
    frames.push_back({{"file", file},
                      {"az", e.azimuth_deg},
                      {"el", e.elevation_deg},
                      {"c2w", camera_to_world(e.cam_from_world)}});
  }
  return {{"K", json_of(synthetic::camera_of(synthetic::orbit_of(options, modality)))},
          {"frames", frames}};
}

}  // namespace

Status write_synthetic_truth(const SyntheticOptions& options, const fs::path& folder) {
  ORBITFUSE_TRY(options.validate());
  const synthetic::Scene scene(options.seed);
  Json truth;
  truth["convention"] = "camera-to-world, OpenGL axes (x right, y up, looks along -z), metres";
  truth["visible"] = orbit_truth(options, Modality::visible);
  truth["thermal"] = orbit_truth(options, Modality::thermal);
  truth["thermal"]["value"] = fmt::format(
      "uint16 centikelvin, T[K] = 0.01 DN; noise {} K, fixed pattern {} K, vignetting to -{} K, "
      "per-frame drift sigma {} K",
      options.defects.noise_k, options.defects.fixed_pattern_k, options.defects.vignetting_k,
      options.defects.drift_k);
  const Camera camera = synthetic::test_camera(options);
  Json frames = Json::array();
  const std::vector<Rigid3d> poses = synthetic::test_poses(options);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::string visible = fmt::format("test/{:02}_visible.jpg", i),
                      thermal = fmt::format("test/{:02}_thermal.tiff", i);
    const int samples = options.samples_per_axis;
    ORBITFUSE_TRY(write_jpeg(folder / visible,
                             synthetic::render_visible(scene, camera, poses[i], samples), 95));
    const cv::Mat kelvin = synthetic::render_thermal(scene, camera, poses[i], samples);
    ORBITFUSE_ASSIGN(const std::string tiff,
                     encode_thermal_tiff(synthetic::ideal_centikelvin(kelvin)));
    ORBITFUSE_TRY(write_file_atomic(folder / thermal, tiff));
    frames.push_back(
        {{"visible", visible}, {"thermal", thermal}, {"c2w", camera_to_world(poses[i])}});
  }
  truth["test"] = {{"K", json_of(camera)},
                   {"frames", frames},
                   {"value", "visible and thermal from one camera, thermal noise-free"}};
  return write_file_atomic(folder / "ground_truth.json", truth.dump(1) + "\n");
}

Status record_synthetic_session(const SyntheticOptions& options, const fs::path& folder,
                                const Progress& progress) {
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_ASSIGN(const auto writer,
                   SessionWriter::create(folder, {{"recorded_by", "synthetic"},
                                                  {"seed", std::to_string(options.seed)}}));
  const auto visible = make_synthetic_source(options, Modality::visible);
  const auto thermal = make_synthetic_source(options, Modality::thermal);
  RecorderOptions recorder_options;
  recorder_options.backpressure = Backpressure::wait;
  Recorder recorder(*writer, recorder_options);
  const double total = static_cast<double>(synthetic::walk(options, Modality::visible).size() +
                                           synthetic::walk(options, Modality::thermal).size());
  std::atomic<int> done{0};
  recorder.on_frame = [&](const StoredFrame& stored) {
    progress.report({"record", static_cast<double>(++done), total, {}, stored.record.file});
  };
  ORBITFUSE_TRY(recorder.run({visible.get(), thermal.get()}, progress));
  ORBITFUSE_TRY(writer->close());
  return write_synthetic_truth(options, folder);
}

}  // namespace orbitfuse
