// SPDX-License-Identifier: BSD-3-Clause
#include "bench/nerf/scenes.hpp"

#include <cmath>
#include <map>

#include "core/formats/colmap_model.hpp"
#include "core/formats/ground_truth.hpp"
#include "core/formats/transforms_json.hpp"
#include "core/image/image_io.hpp"

namespace orbitfuse::bench {
namespace {

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
bool in_sector(const Rigid3d& cam_from_world) {
  const Eigen::Vector3d center = camera_center(cam_from_world);
  const double azimuth = std::atan2(center.y(), center.x()) * 180 / 3.14159265358979;
  return azimuth >= 10 && azimuth <= 135;
}

/// Removes "-WORD" from the end of the name; whether it was there.
bool take_word(std::string& name, const std::string& word) {
  if (!name.ends_with("-" + word)) return false;
  name.resize(name.size() - word.size() - 1);
  return true;
}

Result<nerf::Dataset> load_orbit(const std::filesystem::path& folder, Modality modality,
                                 bool sector, bool full) {
  const bool thermal = modality == Modality::thermal;
  nerf::Dataset data;
  data.modality = modality;
  ORBITFUSE_ASSIGN(const GroundTruth truth, read_ground_truth(folder / "ground_truth.json"));
  const auto add = [&](const std::filesystem::path& file, const Camera& camera, const Rigid3d& pose,
                       bool measure_only) -> Status {
    if (sector && !in_sector(pose)) return {};
    ORBITFUSE_ASSIGN(nerf::TrainingView view,
                     load_view(file, camera, pose, modality, measure_only));
    const Camera& c = view.camera;
    data.views.push_back(thermal || full ? std::move(view)
                                         : nerf::resized(view, 400, 400 * c.height / c.width));
    return {};
  };
  if (truth.views.count(modality) > 0)
    for (const TrueView& view : truth.views.at(modality))
      ORBITFUSE_TRY(add(folder / view.name, view.camera, view.cam_from_world, false));
  for (const TrueTestView& view : truth.test)
    ORBITFUSE_TRY(
        add(thermal ? view.thermal : view.visible, view.camera, view.cam_from_world, true));
  return data;
}

}  // namespace

Result<nerf::Dataset> load_scene(const std::string& name, const std::filesystem::path& folder,
                                 const std::filesystem::path& model) {
  if (name == "fox") return load_fox(folder / "fox");
  std::string base = name;
  const bool full = take_word(base, "full"), sector = take_word(base, "sector");
  const Modality modality = take_word(base, "thermal") ? Modality::thermal : Modality::visible;
  ORBITFUSE_ASSIGN(
      nerf::Dataset data,
      load_orbit(base.find('/') == std::string::npos ? folder / base : std::filesystem::path(base),
                 modality, sector, full));
  if (!model.empty()) ORBITFUSE_TRY(add_points(data, model));
  return data;
}

}  // namespace orbitfuse::bench
