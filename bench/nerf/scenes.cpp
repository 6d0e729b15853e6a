// SPDX-License-Identifier: BSD-3-Clause
#include "bench/nerf/scenes.hpp"

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "core/formats/colmap_model.hpp"
#include "core/system/file_io.hpp"
#include "core/image/image_io.hpp"
#include "core/formats/transforms_json.hpp"

namespace orbitfuse::bench {
namespace {

using nlohmann::json;

Camera camera_of(const json& k) {
  Camera c;
  c.width = k.at("w");
  c.height = k.at("h");
  c.fx = k.at("fx");
  c.fy = k.at("fy");
  c.cx = k.at("cx");
  c.cy = k.at("cy");
  c.k1 = k.value("k1", 0.0);
  c.k2 = k.value("k2", 0.0);
  c.p1 = k.value("p1", 0.0);
  c.p2 = k.value("p2", 0.0);
  return c;
}

Rigid3d pose_of(const json& frame) {
  Eigen::Matrix4d c2w;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c)
      c2w(r, c) = frame.at("c2w").at(static_cast<std::size_t>(r)).at(static_cast<std::size_t>(c));
  return cam_from_world_of_opengl(c2w);
}

Result<nerf::TrainingView> load_view(const std::filesystem::path& file, const Camera& camera,
                                     const Rigid3d& pose, Modality modality, bool measure_only) {
  nerf::TrainingView view{file.filename().string(), camera, pose, {}, measure_only};
  if (modality == Modality::visible) {
    ORBITFUSE_ASSIGN(const cv::Mat bgr, read_visible(file));
    view.image = nerf::rgb_of_bgr8(bgr);
  } else {
    ORBITFUSE_ASSIGN(view.image, read_thermal_k(file));
  }
  return view;
}

Result<nerf::Dataset> load_fox(const std::filesystem::path& folder) {
  nerf::Dataset data;
  ORBITFUSE_ASSIGN(const Transforms transforms, read_transforms_json(folder / "transforms.json"));
  for (std::size_t i = 0; i < transforms.frames.size(); ++i) {
    const TransformsFrame& frame = transforms.frames[i];
    ORBITFUSE_ASSIGN(const nerf::TrainingView view,
                     load_view(folder / frame.file_path, frame.camera, frame.cam_from_world,
                               Modality::visible, i % 8 == 0));
    data.views.push_back(nerf::resized(view, view.camera.width / 2, view.camera.height / 2));
  }
  return data;
}

Status add_points(nerf::Dataset& data, const std::filesystem::path& model) {
  ORBITFUSE_ASSIGN(const Reconstruction points, read_colmap_model(model, Modality::visible));
  std::map<std::string, int> index;
  for (std::size_t i = 0; i < data.views.size(); ++i)
    index[data.views[i].name] = static_cast<int>(i);
  for (SparsePoint point : points.points) {
    for (Observation& o : point.track) {
      const PosedView& from = points.views[static_cast<std::size_t>(o.view)];
      const auto found = index.find(std::filesystem::path(from.name).filename().string());
      if (found == index.end())
        return fail(ErrorKind::input, from.name, "not a view of this scene", "use its own model");
      o.view = found->second;
      const Camera& to = data.views[static_cast<std::size_t>(o.view)].camera;
      o.pixel.x() *= static_cast<double>(to.width) / from.camera.width;
      o.pixel.y() *= static_cast<double>(to.height) / from.camera.height;
    }
    data.points.push_back(std::move(point));
  }
  return {};
}

/// 125 degrees: of a 30 degree orbit four or five stations of each loop.
bool in_sector(const json& frame) {
  const Eigen::Vector3d center = camera_center(pose_of(frame));
  const double azimuth = std::atan2(center.y(), center.x()) * 180 / 3.14159265358979;
  return azimuth >= 10 && azimuth <= 135;
}

/// Removes "-WORD" from the end of the name; whether it was there.
bool take_word(std::string& name, const std::string& word) {
  if (!name.ends_with("-" + word)) return false;
  name.resize(name.size() - word.size() - 1);
  return true;
}

Result<nerf::Dataset> load_orbit(const std::filesystem::path& folder, Modality modality, bool sector, bool full) {
  const bool thermal = modality == Modality::thermal;
  const std::string own(name(modality));
  nerf::Dataset data;
  data.modality = modality;
  ORBITFUSE_ASSIGN(const std::string text, read_file(folder / "ground_truth.json"));
  const json truth = json::parse(text);
  for (const std::string& group : {own, std::string("test")})
    for (const json& frame : truth.at(group).at("frames")) {
      if (sector && !in_sector(frame)) continue;
      const bool test = group == "test";
      ORBITFUSE_ASSIGN(nerf::TrainingView view,
                       load_view(folder / frame.at(test ? own : "file").get<std::string>(),
                                 camera_of(truth.at(group).at("K")), pose_of(frame), modality, test));
      const Camera& c = view.camera;
      data.views.push_back(thermal || full ? std::move(view) : nerf::resized(view, 400, 400 * c.height / c.width));
    }
  return data;
}

}  // namespace

Result<nerf::Dataset> load_scene(const std::string& name, const std::filesystem::path& folder,
                                 const std::filesystem::path& model) {
  if (name == "fox") return load_fox(folder / "fox");
  std::string base = name;
  const bool full = take_word(base, "full"), sector = take_word(base, "sector");
  const Modality modality = take_word(base, "thermal") ? Modality::thermal : Modality::visible;
  ORBITFUSE_ASSIGN(nerf::Dataset data, load_orbit(base.find('/') == std::string::npos ? folder / base : std::filesystem::path(base),
                                                  modality, sector, full));
  if (!model.empty()) ORBITFUSE_TRY(add_points(data, model));
  return data;
}

}  // namespace orbitfuse::bench
