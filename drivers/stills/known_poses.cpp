// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/known_poses.hpp"

#include <fmt/format.h>

#include "core/formats/colmap_model.hpp"
#include "core/formats/ground_truth.hpp"
#include "core/formats/transforms_json.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;

/// A missing file may be named without its extension (NeRF's synthetic scenes).
fs::path resolve(const fs::path& base, const std::string& name) {
  fs::path path = (base / name).lexically_normal();
  std::error_code ignored;
  if (fs::exists(path, ignored)) return path;
  for (const char* extension : {".png", ".jpg", ".jpeg", ".JPG", ".tiff", ".tif"}) {
    fs::path candidate = path.string() + extension;
    if (fs::exists(candidate, ignored)) return candidate;
  }
  return path;
}

Status add_transforms(const fs::path& file, std::map<Modality, KnownViews>& known) {
  ORBITFUSE_ASSIGN(const Transforms transforms, read_transforms_json(file));
  for (const TransformsFrame& frame : transforms.frames) {
    known[Modality::visible].add(
        {resolve(file.parent_path(), frame.file_path), frame.camera, frame.cam_from_world, {}});
    if (frame.thermal_file_path) {
      known[Modality::thermal].add({resolve(file.parent_path(), *frame.thermal_file_path),
                                    frame.camera,
                                    frame.cam_from_world,
                                    {}});
    }
  }
  return {};
}

Status add_colmap(const fs::path& folder, Modality modality,
                  std::map<Modality, KnownViews>& known) {
  ORBITFUSE_ASSIGN(const Reconstruction model, read_colmap_model(folder, modality));
  if (model.views.empty())
    return fail(ErrorKind::input, folder.string(), "no images in the model",
                "give a model in which images were placed, or none");
  for (const PosedView& view : model.views)
    known[modality].add({view.name, view.camera, view.cam_from_world, {}});
  return {};
}

}  // namespace

namespace {

/// One name for a file however it is written, links followed.
std::string canonical_name(const fs::path& file) {
  std::error_code unresolved;
  const fs::path canonical = fs::weakly_canonical(file, unresolved);
  return (unresolved ? fs::absolute(file, unresolved).lexically_normal() : canonical).string();
}

}  // namespace

void KnownViews::add(KnownView view) {
  const std::size_t index = views_.size();
  by_file_.emplace(canonical_name(view.file), index);
  ++by_name_.try_emplace(view.file.filename().string(), Named{index, 0}).first->second.views;
  ++by_stem_.try_emplace(view.file.stem().string(), Named{index, 0}).first->second.views;
  views_.push_back(std::move(view));
}

const KnownView* KnownViews::find(const fs::path& file) const {
  if (const auto same = by_file_.find(canonical_name(file)); same != by_file_.end())
    return &views_[same->second];
  for (const auto& [names, name] :
       {std::pair{&by_name_, file.filename().string()}, {&by_stem_, file.stem().string()}}) {
    const auto found = names->find(name);
    if (found == names->end()) continue;
    // Ambiguous: no pose is better than a wrong one.
    return found->second.views == 1 ? &views_[found->second.index] : nullptr;
  }
  return nullptr;
}

std::string KnownViews::ambiguity(const fs::path& file) const {
  const auto named = by_name_.find(file.filename().string());
  if (named == by_name_.end() || named->second.views < 2 || find(file)) return {};
  constexpr std::size_t most_named = 3;
  std::vector<std::string> folders;
  for (const KnownView& view : views_)
    if (folders.size() < most_named && view.file.filename() == file.filename())
      folders.push_back(view.file.parent_path().string());
  return fmt::format("{} is there {} times ({}{})", file.filename().string(), named->second.views,
                     fmt::join(folders, ", "), named->second.views > 3 ? ", ..." : "");
}

std::optional<Camera> KnownViews::shared_camera() const {
  if (views_.empty()) return std::nullopt;
  for (const KnownView& view : views_) {
    if (!(view.camera == views_.front().camera)) return std::nullopt;
  }
  return views_.front().camera;
}

Result<std::map<Modality, KnownViews>> read_ground_truth_views(const fs::path& file) {
  ORBITFUSE_ASSIGN(const GroundTruth truth, read_ground_truth(file));
  std::map<Modality, KnownViews> known;
  for (const auto& [modality, views] : truth.views) {
    for (const TrueView& view : views) {
      known[modality].add({(file.parent_path() / view.name).lexically_normal(), view.camera,
                           view.cam_from_world, view.elevation_deg});
    }
  }
  return known;
}

Result<std::map<Modality, KnownViews>> read_known_poses(const ImportOptions& options) {
  std::map<Modality, KnownViews> known;
  if (options.ground_truth) {
    ORBITFUSE_ASSIGN(known, read_ground_truth_views(*options.ground_truth));
  }
  if (options.transforms_json) ORBITFUSE_TRY(add_transforms(*options.transforms_json, known));
  if (options.visible_colmap)
    ORBITFUSE_TRY(add_colmap(*options.visible_colmap, Modality::visible, known));
  if (options.thermal_colmap)
    ORBITFUSE_TRY(add_colmap(*options.thermal_colmap, Modality::thermal, known));
  return known;
}

}  // namespace orbitfuse
