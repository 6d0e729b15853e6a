// SPDX-License-Identifier: BSD-3-Clause
#include "core/formats/ground_truth.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "core/formats/rigid_matrix.hpp"
#include "core/json_fields.hpp"
#include "core/nested_text.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse {
namespace {

using Json = nlohmann::json;

constexpr std::size_t max_name_bytes = 4096;  // a path's, on Linux
constexpr const char* described = "docs/formats.md describes the file";

/// The camera's fields lie in "K", with names of their own.
Result<Camera> camera_of(const JsonFields& object) {
  ORBITFUSE_ASSIGN(const JsonFields k, object.child("K"));
  Camera c;
  double width = 0, height = 0;
  ORBITFUSE_TRY(k.get("w", width, from_to(1, 1e6)));
  ORBITFUSE_TRY(k.get("h", height, from_to(1, 1e6)));
  c.width = static_cast<int>(width);
  c.height = static_cast<int>(height);
  ORBITFUSE_TRY(k.get_all("fx", c.fx, "fy", c.fy, "cx", c.cx, "cy", c.cy));
  ORBITFUSE_TRY(k.get_present("k1", c.k1, "k2", c.k2, "p1", c.p1, "p2", c.p2));
  ORBITFUSE_TRY(c.validate(k.place()));
  return c;
}

Result<Rigid3d> pose_of(const JsonFields& frame) {
  const Json* rows = frame.find("c2w");
  return rigid_of_opengl_json(rows != nullptr ? *rows : Json(), frame.at("c2w"));
}

std::optional<double> optional_degrees(const JsonFields& frame, const char* key) {
  double degrees = 0;
  return frame.get(key, degrees, from_to(-360, 360)) ? std::optional(degrees) : std::nullopt;
}

Result<std::vector<TrueView>> views_of(const JsonFields& object) {
  ORBITFUSE_TRY(object.check_object());
  ORBITFUSE_ASSIGN(const std::vector<JsonFields> frames, object.children("frames"));
  if (frames.empty())
    return fail(ErrorKind::input, object.at("frames"), "an empty list",
                "list a frame, or leave the modality out");
  ORBITFUSE_ASSIGN(const Camera camera, camera_of(object));
  std::vector<TrueView> views;
  std::set<std::string> names;
  for (const JsonFields& frame : frames) {
    TrueView view;
    ORBITFUSE_TRY(frame.get_word("file", view.name, max_name_bytes));
    if (!names.insert(view.name).second)
      return fail(ErrorKind::input, frame.at("file"), view.name + ", which is listed before",
                  "list each frame once");
    view.camera = camera;
    ORBITFUSE_ASSIGN(view.cam_from_world, pose_of(frame));
    view.azimuth_deg = optional_degrees(frame, "az");
    view.elevation_deg = optional_degrees(frame, "el");
    views.push_back(std::move(view));
  }
  return views;
}

Result<std::vector<TrueTestView>> test_views_of(const JsonFields& object,
                                                const std::filesystem::path& folder) {
  ORBITFUSE_ASSIGN(const std::vector<JsonFields> frames, object.children("frames"));
  ORBITFUSE_ASSIGN(const Camera camera, camera_of(object));
  std::vector<TrueTestView> views;
  for (const JsonFields& frame : frames) {
    TrueTestView view{{}, {}, camera, {}};
    ORBITFUSE_ASSIGN(view.cam_from_world, pose_of(frame));
    for (const auto& [key, file] :
         {std::pair{"visible", &view.visible}, {"thermal", &view.thermal}}) {
      if (!frame.has(key)) continue;
      std::string name;
      ORBITFUSE_TRY(frame.get_word(key, name, max_name_bytes));
      *file = folder / name;
    }
    views.push_back(std::move(view));
  }
  return views;
}

Result<Json> read_object(const std::filesystem::path& file) {
  ORBITFUSE_ASSIGN(const std::string text, read_file(file, max_text_bytes));
  Json root = parse_json(text);
  if (root.is_object()) return root;
  return fail(ErrorKind::input, file.string(),
              root.is_discarded() ? json_fault(text) : "not a JSON object", described);
}

JsonFields fields_of(const Json& root, const std::filesystem::path& file) {
  return {root, file.string() + ": ", {ErrorKind::input, described}};
}

}  // namespace

Result<GroundTruth> read_ground_truth(const std::filesystem::path& file) {
  ORBITFUSE_ASSIGN(const Json root, read_object(file));
  const JsonFields fields = fields_of(root, file);
  GroundTruth truth;
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    const std::string key(name(modality));
    if (!fields.has(key.c_str())) continue;
    ORBITFUSE_ASSIGN(const JsonFields orbit, fields.child(key.c_str()));
    ORBITFUSE_ASSIGN(truth.views[modality], views_of(orbit));
  }
  if (truth.views.empty())
    return fail(ErrorKind::input, file.string(), "neither \"visible\" nor \"thermal\"", described);
  if (fields.has("test")) {
    ORBITFUSE_ASSIGN(const JsonFields test, fields.child("test"));
    ORBITFUSE_ASSIGN(truth.test, test_views_of(test, file.parent_path()));
  }
  return truth;
}

Result<std::vector<TrueView>> read_true_views(const std::filesystem::path& file) {
  ORBITFUSE_ASSIGN(const Json root, read_object(file));
  return views_of(fields_of(root, file));
}

}  // namespace orbitfuse
