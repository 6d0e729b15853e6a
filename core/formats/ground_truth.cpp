// SPDX-License-Identifier: BSD-3-Clause
#include "core/formats/ground_truth.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>

#include "core/formats/rigid_matrix.hpp"
#include "core/nested_text.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse {
namespace {

using Json = nlohmann::json;

tl::unexpected<Error> bad(const std::string& where, const std::string& found) {
  return fail(ErrorKind::input, where, found, "docs/formats.md describes the file");
}

Result<double> number(const Json& object, const char* key, const std::string& where) {
  if (!object.is_object() || !object.contains(key) || !object[key].is_number()) {
    return bad(where + "." + key, "no number");
  }
  return object[key].get<double>();
}

Result<Camera> camera_of(const Json& object, const std::string& where) {
  const Json k = object.is_object() ? object.value("K", Json()) : Json();
  const std::string at = where + ".K";
  Camera c;
  for (const auto& [key, side] : {std::pair{"w", &c.width}, {"h", &c.height}}) {
    ORBITFUSE_ASSIGN(const double pixels, number(k, key, at));
    if (!(pixels >= 1 && pixels <= 1e6))
      return bad(at + "." + key, fmt::format("{:g} pixels", pixels));
    *side = static_cast<int>(pixels);
  }
  for (const auto& [key, value] :
       {std::pair{"fx", &c.fx}, {"fy", &c.fy}, {"cx", &c.cx}, {"cy", &c.cy}}) {
    ORBITFUSE_ASSIGN(*value, number(k, key, at));
  }
  for (const auto& [key, value] :
       {std::pair{"k1", &c.k1}, {"k2", &c.k2}, {"p1", &c.p1}, {"p2", &c.p2}}) {
    if (!k.contains(key)) continue;
    ORBITFUSE_ASSIGN(*value, number(k, key, at));
  }
  ORBITFUSE_TRY(c.validate(at));
  return c;
}

Result<Rigid3d> pose_of(const Json& frame, const std::string& where) {
  return rigid_of_opengl_json(frame.is_object() ? frame.value("c2w", Json()) : Json(),
                              where + ".c2w");
}

std::optional<double> optional_degrees(const Json& frame, const char* key) {
  if (!frame.contains(key) || !frame[key].is_number()) return std::nullopt;
  const double degrees = frame[key].get<double>();
  return std::abs(degrees) <= 360 ? std::optional(degrees) : std::nullopt;
}

Result<const Json*> frames_of(const Json& object, const std::string& where) {
  if (!object.is_object() || !object.contains("frames") || !object["frames"].is_array()) {
    return bad(where, "no K and frames");
  }
  return &object["frames"];
}

Result<std::vector<TrueView>> views_of(const Json& object, const std::string& where) {
  ORBITFUSE_ASSIGN(const Json* frames, frames_of(object, where));
  ORBITFUSE_ASSIGN(const Camera camera, camera_of(object, where));
  std::vector<TrueView> views;
  for (std::size_t i = 0; i < frames->size(); ++i) {
    const Json& frame = (*frames)[i];
    const std::string at = fmt::format("{}.frames[{}]", where, i);
    if (!frame.is_object() || !frame.contains("file") || !frame["file"].is_string())
      return bad(at, "no file");
    TrueView view;
    view.name = frame["file"].get<std::string>();
    view.camera = camera;
    ORBITFUSE_ASSIGN(view.cam_from_world, pose_of(frame, at));
    view.azimuth_deg = optional_degrees(frame, "az");
    view.elevation_deg = optional_degrees(frame, "el");
    views.push_back(std::move(view));
  }
  return views;
}

Result<std::vector<TrueTestView>> test_views_of(const Json& object,
                                                const std::filesystem::path& folder,
                                                const std::string& where) {
  ORBITFUSE_ASSIGN(const Json* frames, frames_of(object, where));
  ORBITFUSE_ASSIGN(const Camera camera, camera_of(object, where));
  std::vector<TrueTestView> views;
  for (std::size_t i = 0; i < frames->size(); ++i) {
    const Json& frame = (*frames)[i];
    TrueTestView view{{}, {}, camera, {}};
    ORBITFUSE_ASSIGN(view.cam_from_world, pose_of(frame, fmt::format("{}.frames[{}]", where, i)));
    for (const auto& [key, file] :
         {std::pair{"visible", &view.visible}, {"thermal", &view.thermal}}) {
      if (frame.contains(key) && frame[key].is_string())
        *file = folder / frame[key].get<std::string>();
    }
    views.push_back(std::move(view));
  }
  return views;
}

Result<Json> read_object(const std::filesystem::path& file) {
  ORBITFUSE_ASSIGN(const std::string text, read_file(file, max_text_bytes));
  Json root = parse_json(text);
  if (!root.is_object()) return bad(file.string(), "not a JSON object (cut off?)");
  return root;
}

}  // namespace

Result<GroundTruth> read_ground_truth(const std::filesystem::path& file) {
  ORBITFUSE_ASSIGN(const Json root, read_object(file));
  GroundTruth truth;
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    const std::string key(name(modality));
    if (!root.contains(key)) continue;
    ORBITFUSE_ASSIGN(truth.views[modality], views_of(root[key], file.string() + ": " + key));
  }
  if (truth.views.empty()) return bad(file.string(), "neither \"visible\" nor \"thermal\"");
  if (root.contains("test")) {
    ORBITFUSE_ASSIGN(truth.test,
                     test_views_of(root["test"], file.parent_path(), file.string() + ": test"));
  }
  return truth;
}

Result<std::vector<TrueView>> read_true_views(const std::filesystem::path& file) {
  ORBITFUSE_ASSIGN(const Json root, read_object(file));
  return views_of(root, file.string());
}

}  // namespace orbitfuse
