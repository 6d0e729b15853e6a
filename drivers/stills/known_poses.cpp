// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/known_poses.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/formats/colmap_model.hpp"
#include "core/system/file_io.hpp"
#include "core/formats/transforms_json.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// A missing file may be named without its extension (NeRF's synthetic scenes).
fs::path resolve(const fs::path& base, const std::string& name) {
  const fs::path path = (base / name).lexically_normal();
  std::error_code ignored;
  if (fs::exists(path, ignored)) return path;
  for (const char* extension : {".png", ".jpg", ".jpeg", ".JPG", ".tiff", ".tif"}) {
    const fs::path candidate = path.string() + extension;
    if (fs::exists(candidate, ignored)) return candidate;
  }
  return path;
}

Status add_transforms(const fs::path& file, std::map<Modality, KnownViews>& known) {
  ORBITFUSE_ASSIGN(const Transforms transforms, read_transforms_json(file));
  for (const TransformsFrame& frame : transforms.frames) {
    known[Modality::visible].add({resolve(file.parent_path(), frame.file_path), frame.camera, frame.cam_from_world, {}});
    if (frame.thermal_file_path) {
      known[Modality::thermal].add(
          {resolve(file.parent_path(), *frame.thermal_file_path), frame.camera, frame.cam_from_world, {}});
    }
  }
  return {};
}

Status add_colmap(const fs::path& folder, Modality modality, std::map<Modality, KnownViews>& known) {
  ORBITFUSE_ASSIGN(const Reconstruction model, read_colmap_model(folder, modality));
  for (const PosedView& view : model.views) known[modality].add({view.name, view.camera, view.cam_from_world, {}});
  return {};
}

tl::unexpected<Error> bad_truth(const std::string& where, const std::string& found) {
  return fail(ErrorKind::input, where, found, "see docs/formats.md, ground truth");
}

Result<double> number(const Json& object, const char* key, const std::string& where) {
  if (!object.is_object() || !object.contains(key) || !object[key].is_number()) {
    return bad_truth(where + "." + key, "no number");
  }
  return object[key].get<double>();
}

Result<Camera> camera_of(const Json& k, const std::string& where) {
  Camera c;
  ORBITFUSE_ASSIGN(const double w, number(k, "w", where));
  ORBITFUSE_ASSIGN(const double h, number(k, "h", where));
  if (!(w >= 1 && w < 1e6 && h >= 1 && h < 1e6)) return bad_truth(where, "no usable image size");
  c.width = static_cast<int>(w);
  c.height = static_cast<int>(h);
  ORBITFUSE_ASSIGN(c.fx, number(k, "fx", where));
  ORBITFUSE_ASSIGN(c.fy, number(k, "fy", where));
  ORBITFUSE_ASSIGN(c.cx, number(k, "cx", where));
  ORBITFUSE_ASSIGN(c.cy, number(k, "cy", where));
  for (const auto& [key, value] : {std::pair{"k1", &c.k1}, {"k2", &c.k2}, {"p1", &c.p1}, {"p2", &c.p2}}) {
    if (k.contains(key)) {
      ORBITFUSE_ASSIGN(*value, number(k, key, where));
    }
  }
  ORBITFUSE_TRY(c.validate(where));
  return c;
}

Result<Rigid3d> pose_of(const Json& frame, const std::string& where) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  const auto broken = [&] { return bad_truth(where + ".c2w", "not a finite 4x4 matrix"); };
  if (!frame.contains("c2w") || !frame["c2w"].is_array() || frame["c2w"].size() < 3) return broken();
  for (std::size_t r = 0; r < 3; ++r) {
    const Json& row = frame["c2w"][r];
    if (!row.is_array() || row.size() != 4) return broken();
    for (std::size_t c = 0; c < 4; ++c) {
      if (!row[c].is_number()) return broken();
      m(static_cast<int>(r), static_cast<int>(c)) = row[c].get<double>();
    }
  }
  if (!m.allFinite() || m.topLeftCorner<3, 3>().determinant() < 0.5) return broken();
  return cam_from_world_of_opengl(m);
}

}  // namespace

void KnownViews::add(KnownView view) { views_.push_back(std::move(view)); }

const KnownView* KnownViews::find(const fs::path& file) const {
  std::error_code ignored;
  for (const KnownView& view : views_) {
    if (fs::equivalent(view.file, file, ignored)) return &view;
  }
  for (const bool by_stem : {false, true}) {
    const KnownView* found = nullptr;
    int matches = 0;
    for (const KnownView& view : views_) {
      const bool same = by_stem ? view.file.stem() == file.stem() : view.file.filename() == file.filename();
      if (same) {
        found = &view;
        ++matches;
      }
    }
    if (matches == 1) return found;
    if (matches > 1) return nullptr;  // ambiguous: no pose is better than a wrong one
  }
  return nullptr;
}

std::optional<Camera> KnownViews::shared_camera() const {
  if (views_.empty()) return std::nullopt;
  for (const KnownView& view : views_) {
    if (!(view.camera == views_.front().camera)) return std::nullopt;
  }
  return views_.front().camera;
}

Result<std::map<Modality, KnownViews>> read_ground_truth_views(const fs::path& file) {
  ORBITFUSE_ASSIGN(const std::string text, read_file(file));
  const Json root = Json::parse(text, nullptr, false);
  if (!root.is_object()) return bad_truth(file.string(), "not a JSON object (cut off?)");
  std::map<Modality, KnownViews> known;
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    const std::string key(name(modality));
    if (!root.contains(key)) continue;
    const Json& part = root[key];
    const std::string where = file.string() + ": " + key;
    if (!part.is_object() || !part.contains("K") || !part.contains("frames") || !part["frames"].is_array()) {
      return bad_truth(where, "no K and frames");
    }
    ORBITFUSE_ASSIGN(const Camera camera, camera_of(part["K"], where + ".K"));
    for (std::size_t i = 0; i < part["frames"].size(); ++i) {
      const Json& frame = part["frames"][i];
      const std::string at = fmt::format("{}.frames[{}]", where, i);
      if (!frame.is_object() || !frame.contains("file") || !frame["file"].is_string()) return bad_truth(at, "no file");
      KnownView view;
      view.file = (file.parent_path() / frame["file"].get<std::string>()).lexically_normal();
      view.camera = camera;
      ORBITFUSE_ASSIGN(view.cam_from_world, pose_of(frame, at));
      if (frame.contains("el") && frame["el"].is_number()) view.elevation_deg = frame["el"].get<double>();
      known[modality].add(std::move(view));
    }
  }
  if (known.empty()) return bad_truth(file.string(), "neither \"visible\" nor \"thermal\"");
  return known;
}

Result<std::map<Modality, KnownViews>> read_known_poses(const ImportOptions& options) {
  std::map<Modality, KnownViews> known;
  if (options.ground_truth) {
    ORBITFUSE_ASSIGN(known, read_ground_truth_views(*options.ground_truth));
  }
  if (options.transforms_json) ORBITFUSE_TRY(add_transforms(*options.transforms_json, known));
  if (options.visible_colmap) ORBITFUSE_TRY(add_colmap(*options.visible_colmap, Modality::visible, known));
  if (options.thermal_colmap) ORBITFUSE_TRY(add_colmap(*options.thermal_colmap, Modality::thermal, known));
  return known;
}

}  // namespace orbitfuse
