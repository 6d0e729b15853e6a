// SPDX-License-Identifier: BSD-3-Clause
#include <fstream>

#include "app/config/settings.hpp"
#include "core/formats/colmap_model.hpp"
#include "core/formats/ground_truth.hpp"
#include "core/formats/ply.hpp"
#include "core/formats/transforms_json.hpp"
#include "core/session/session.hpp"
#include "core/system/file_io.hpp"
#include "tests/fuzz/targets.hpp"

namespace orbitfuse::fuzz {
namespace {

namespace fs = std::filesystem;

const ScratchFile& scratch() {
  static const ScratchFile file;
  return file;
}

void write(const std::string& file, std::string_view bytes) {
  std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
}

void ply(std::string_view bytes) { static_cast<void>(read_ply(scratch().with(bytes))); }

void transforms(std::string_view bytes) {
  static_cast<void>(read_transforms_json(scratch().with(bytes)));
}

void truth(std::string_view bytes) {
  static_cast<void>(read_ground_truth(scratch().with(bytes)));
  static_cast<void>(read_true_views(scratch().with(bytes)));
}

/// Three files in one input, between lines of a single "%".
constexpr std::string_view parting = "\n%\n";

void colmap(std::string_view bytes, const char* extension) {
  const std::string folder = scratch_folder() + "/colmap" + extension;
  fs::create_directories(folder);
  for (const char* name : {"/cameras", "/images", "/points3D"}) {
    const std::size_t end = std::min(bytes.find(parting), bytes.size());
    write(folder + name + extension, bytes.substr(0, end));
    bytes.remove_prefix(std::min(bytes.size(), end + parting.size()));
  }
  static_cast<void>(read_colmap_model(folder, Modality::visible));
}

void colmap_text(std::string_view bytes) { colmap(bytes, ".txt"); }
void colmap_binary(std::string_view bytes) { colmap(bytes, ".bin"); }

void manifest(std::string_view bytes) {
  const std::string folder = scratch_folder() + "/session";
  fs::create_directories(folder);
  write(folder + "/manifest.jsonl", bytes);
  static_cast<void>(open_session(folder));
}

void toml(std::string_view bytes) {
  double number = 1;
  int count = 2;
  bool flag = false;
  std::string text = "a";
  config::Settings settings;
  settings.add("a.number", number, "a number");
  settings.add("a.count", count, "a count");
  settings.add("b.flag", flag, "a flag");
  settings.add("b.c.text", text, "a text");
  static_cast<void>(settings.read_toml(scratch().with(bytes)));
  static_cast<void>(settings.apply(std::string(bytes)));
}

Reconstruction small_model() {
  Reconstruction model;
  for (int i = 0; i < 2; ++i) {
    Rigid3d pose;
    pose.translation = {0.5 * i, 0, 2};
    model.views.push_back({"p" + std::to_string(i) + ".jpg", Camera::from_fov(40, 30, 50), pose});
  }
  model.points.push_back({{0.1, 0.2, 0.3}, {1, 2, 3}, 0.5, {{0, {3, 4}}, {1, {5, 6}}}});
  return model;
}

std::vector<std::string> ply_seeds() {
  PointCloud cloud;
  for (int i = 0; i < 3; ++i) {
    cloud.positions.emplace_back(i, 2 * i, 0.5);
    cloud.normals.emplace_back(0.F, 0.F, 1.F);
    cloud.colors.push_back({1, 2, 3});
    cloud.temperatures_k.push_back(300);
  }
  const std::string file = scratch_folder() + "/seed.ply";
  static_cast<void>(write_ply(file, cloud));
  return {
      read_file(file).value(),
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float "
      "z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 2 3\n3 0 1 1\n",
      "ply\nformat binary_big_endian 1.0\nelement face 1\nproperty list uchar int i\nelement "
      "vertex 1\n"
      "property double x\nproperty double y\nproperty double z\nend_header\n" +
          std::string(29, '\0')};
}

std::vector<std::string> colmap_seeds(ColmapFormat format) {
  const std::string folder = scratch_folder() + "/seed_model",
                    extension = format == ColmapFormat::text ? ".txt" : ".bin";
  static_cast<void>(write_colmap_model(folder, small_model(), format));
  std::string seed;
  for (const char* name : {"/cameras", "/images", "/points3D"})
    seed +=
        (seed.empty() ? "" : std::string(parting)) + read_file(folder + name + extension).value();
  return {seed};
}
std::vector<std::string> colmap_text_seeds() { return colmap_seeds(ColmapFormat::text); }
std::vector<std::string> colmap_binary_seeds() { return colmap_seeds(ColmapFormat::binary); }

std::vector<std::string> transforms_seeds() {
  Transforms t;
  for (const PosedView& view : small_model().views)
    t.frames.push_back({view.name, "t.tiff", view.camera, view.cam_from_world});
  const std::string file = scratch_folder() + "/seed.json";
  static_cast<void>(write_transforms_json(file, t));
  return {
      read_file(file).value(),
      R"({"camera_angle_x":0.7,"w":40,"h":30,"frames":[{"file_path":"a","transform_matrix":[[1,0,0,0],[0,1,0,0],[0,0,1,4]]}]})"};
}

std::vector<std::string> truth_seeds() {
  return {
      R"({"visible":{"K":{"fx":90,"fy":90,"cx":50,"cy":40,"w":100,"h":80},"frames":[{"file":"v.jpg","az":3,"el":20,)"
      R"("c2w":[[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]}]},"test":{"K":{"fx":90,"fy":90,"cx":50,"cy":40,"w":100,)"
      R"("h":80},"frames":[{"visible":"a.jpg","thermal":"b.tiff","c2w":[[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]}]}})",
      R"({"K":{"fx":90,"fy":90,"cx":50,"cy":40,"w":100,"h":80,"k1":0.1},"frames":[]})"};
}

std::vector<std::string> manifest_seeds() {
  Session session;
  session.id = "0123";
  session.notes["recorded_by"] = "fuzz";
  DeviceInfo device;
  device.id = "visible0";
  device.lens.focal_px = 40;
  device.lens.calibrated = Camera::from_fov(40, 30, 50);
  FrameRecord frame;
  frame.device = "visible0";
  frame.file = "visible/000000.jpg";
  frame.width = 40;
  frame.height = 30;
  frame.station = Station{};
  frame.cam_from_world = Rigid3d{};
  frame.camera = device.lens.calibrated;
  frame.flags = {"still"};
  frame.quality = FrameQuality{0.5, 100, 0.1, EdgeBlur{1.2, 30}};
  const std::string lines[] = {manifest_header_line(session),
                               manifest_line(device),
                               manifest_line(frame),
                               manifest_line(GapRecord{"visible0", 3, 2, "network"}),
                               manifest_line(StreamRecord{"visible0", 0, 5, 4, 2}),
                               manifest_line(EventRecord{"visible0", 7, "nuc", ""}),
                               manifest_end_line(session)};
  std::string seed;
  for (const std::string& line : lines) seed += line + "\n";
  return {seed};
}

std::vector<std::string> toml_seeds() {
  return {"[a]\nnumber = 1.5 # half\ncount = 7\n[b]\nflag = true\n[b.c]\ntext = \"x\\u00e9\"\n",
          "a = {number = 3, count = [1, 2]}\nb.c.text = '''long\ntext'''\ndate = "
          "2024-01-02T03:04:05Z\n",
          "a.number=2"};
}

}  // namespace

const std::vector<Target>& format_targets() {
  static const std::vector<Target> list{{"ply", ply, ply_seeds},
                                        {"colmap_text", colmap_text, colmap_text_seeds},
                                        {"colmap_binary", colmap_binary, colmap_binary_seeds},
                                        {"transforms", transforms, transforms_seeds},
                                        {"truth", truth, truth_seeds},
                                        {"manifest", manifest, manifest_seeds},
                                        {"toml", toml, toml_seeds}};
  return list;
}

}  // namespace orbitfuse::fuzz
