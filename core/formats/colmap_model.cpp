// SPDX-License-Identifier: BSD-3-Clause
#include "core/formats/colmap_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <unordered_map>

#include "core/formats/colmap_records.hpp"
#include "core/formats/rigid_matrix.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse {
namespace {

using namespace colmap;

/// Number and names of the models we read: COLMAP's src/base/camera_models.h.
struct ModelInfo {
  int id;
  const char* name;
  std::size_t parameters;
};
constexpr std::array<ModelInfo, 5> known_models{{{0, "SIMPLE_PINHOLE", 3},
                                                 {1, "PINHOLE", 4},
                                                 {2, "SIMPLE_RADIAL", 4},
                                                 {3, "RADIAL", 5},
                                                 {4, "OPENCV", 8}}};

Result<Camera> camera_of(const CameraRecord& record, const std::string& where) {
  const auto& p = record.parameters;
  Camera c;
  c.width = static_cast<int>(std::min<std::uint64_t>(record.width, 1'000'000));
  c.height = static_cast<int>(std::min<std::uint64_t>(record.height, 1'000'000));
  const bool one_focal = record.model != 1 && record.model != 4;
  c.fx = p[0];
  c.fy = one_focal ? p[0] : p[1];
  c.cx = one_focal ? p[1] : p[2];
  c.cy = one_focal ? p[2] : p[3];
  if (record.model == 2 || record.model == 3) c.k1 = p[3];
  if (record.model == 3) c.k2 = p[4];
  if (record.model == 4) {
    c.k1 = p[4];
    c.k2 = p[5];
    c.p1 = p[6];
    c.p2 = p[7];
  }
  ORBITFUSE_TRY(c.validate(where));
  return c;
}

/// The raw records joined by their ids into a Reconstruction.
Result<Reconstruction> join(const Records& records, const std::filesystem::path& folder,
                            Modality modality) {
  Reconstruction model;
  model.modality = modality;
  std::unordered_map<std::uint32_t, Camera> cameras;
  for (const CameraRecord& record : records.cameras) {
    const std::string where = fmt::format("{}: camera {}", folder.string(), record.id);
    ORBITFUSE_ASSIGN(const Camera camera, camera_of(record, where));
    if (!cameras.emplace(record.id, camera).second)
      return fail(ErrorKind::input, where, "is there twice", "export the model again");
  }
  // COLMAP writes images in hash order; names make the order reproducible.
  std::vector<const ImageRecord*> images;
  for (const ImageRecord& image : records.images) images.push_back(&image);
  std::sort(images.begin(), images.end(),
            [](const auto* a, const auto* b) { return a->name < b->name; });
  std::unordered_map<std::uint32_t, std::size_t> view_of_image;
  for (const ImageRecord* image : images) {
    const auto camera = cameras.find(image->camera);
    const std::string where = fmt::format("{}: image \"{}\"", folder.string(), image->name);
    if (camera == cameras.end()) {
      return fail(ErrorKind::input, where,
                  fmt::format("refers to camera {}, which is not there", image->camera),
                  "export the model again");
    }
    // Far from 1 it is no quaternion that lost digits but damage, and its square would overflow.
    const auto& q = image->cam_from_world.rotation.coeffs();
    if (!image->cam_from_world.is_finite() || !(q.cwiseAbs().maxCoeff() > 1e-3) ||
        q.cwiseAbs().maxCoeff() > 1e3) {
      return fail(
          ErrorKind::input, where,
          fmt::format("a quaternion of {:g} {:g} {:g} {:g}, or a position that is not finite", q[3],
                      q[0], q[1], q[2]),
          "export the model again");
    }
    if (image->cam_from_world.translation.cwiseAbs().maxCoeff() > max_coordinate) {
      return fail(ErrorKind::input, where,
                  fmt::format("a translation of {:g}",
                              image->cam_from_world.translation.cwiseAbs().maxCoeff()),
                  "export the model again");
    }
    Rigid3d pose = image->cam_from_world;
    pose.rotation.normalize();
    if (!view_of_image.emplace(image->id, model.views.size()).second)
      return fail(ErrorKind::input, where,
                  fmt::format("has the number {} of another image", image->id),
                  "export the model again");
    model.views.push_back({image->name, camera->second, pose});
  }
  for (const PointRecord& record : records.points) {
    SparsePoint point{record.position, record.rgb, record.error, {}};
    for (const auto& [image, index] : record.track) {
      const auto view = view_of_image.find(image);
      // Observations of images that were left out are dropped; the point stays.
      if (view == view_of_image.end()) continue;
      const ImageRecord& seen = *images[view->second];
      if (index >= seen.pixels.size()) {
        return fail(ErrorKind::input, fmt::format("{}: point {}", folder.string(), record.id),
                    fmt::format("refers to observation {} of image \"{}\", which has {}", index,
                                seen.name, seen.pixels.size()),
                    "export the model again");
      }
      point.track.push_back({static_cast<int>(view->second), seen.pixels[index]});
    }
    model.points.push_back(std::move(point));
  }
  return model;
}

/// A Reconstruction as COLMAP's records; equal cameras share one.
Records records_of(const Reconstruction& model) {
  Records records;
  std::vector<Camera> cameras;
  for (std::size_t i = 0; i < model.views.size(); ++i) {
    const PosedView& view = model.views[i];
    const auto known = std::find(cameras.begin(), cameras.end(), view.camera);
    const auto camera = static_cast<std::uint32_t>(known - cameras.begin()) + 1;
    if (known == cameras.end()) cameras.push_back(view.camera);
    records.images.push_back(
        {static_cast<std::uint32_t>(i) + 1, view.cam_from_world, camera, view.name, {}, {}});
  }
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Camera& c = cameras[i];
    records.cameras.push_back({static_cast<std::uint32_t>(i) + 1,
                               4,
                               static_cast<std::uint64_t>(c.width),
                               static_cast<std::uint64_t>(c.height),
                               {c.fx, c.fy, c.cx, c.cy, c.k1, c.k2, c.p1, c.p2}});
  }
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    const SparsePoint& point = model.points[i];
    PointRecord record{i + 1, point.position, point.rgb, point.reprojection_error_px, {}};
    for (const Observation& o : point.track) {
      ImageRecord& image = records.images[static_cast<std::size_t>(o.view)];
      record.track.emplace_back(image.id, static_cast<std::uint32_t>(image.pixels.size()));
      image.pixels.push_back(o.pixel);
      image.points.push_back(static_cast<std::int64_t>(i) + 1);
    }
    records.points.push_back(std::move(record));
  }
  return records;
}

}  // namespace

std::optional<std::size_t> colmap::parameter_count(int model) {
  for (const ModelInfo& m : known_models) {
    if (m.id == model) return m.parameters;
  }
  return std::nullopt;
}

std::optional<int> colmap::model_id(const std::string& model_name) {
  for (const ModelInfo& m : known_models) {
    if (m.name == model_name) return m.id;
  }
  return std::nullopt;
}

const char* colmap::model_name(int model) {
  return known_models[static_cast<std::size_t>(model)].name;
}

tl::unexpected<Error> colmap::unknown_model(const std::string& where, const std::string& model) {
  return fail(ErrorKind::input, where, "camera model " + model + " is not supported",
              "use SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL or OPENCV");
}

Result<Reconstruction> read_colmap_model(const std::filesystem::path& folder, Modality modality) {
  std::error_code ignored;
  const bool binary = std::filesystem::exists(folder / "images.bin", ignored);
  if (!binary && !std::filesystem::exists(folder / "images.txt", ignored)) {
    return fail(ErrorKind::input, folder.string(), "no COLMAP model (images.bin or images.txt)",
                "give the folder that holds cameras, images and points3D");
  }
  ORBITFUSE_ASSIGN(const Records records, binary ? read_binary(folder) : read_text(folder));
  return join(records, folder, modality);
}

Status write_colmap_model(const std::filesystem::path& folder, const Reconstruction& model,
                          ColmapFormat format) {
  const Records records = records_of(model);
  return format == ColmapFormat::binary ? write_binary(folder, records)
                                        : write_text(folder, records);
}

}  // namespace orbitfuse
