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

/// One name for a file however it is written, links followed.
std::string canonical_name(const fs::path& file) {
  std::error_code unresolved;
  const fs::path canonical = fs::weakly_canonical(file, unresolved);
  return (unresolved ? fs::absolute(file, unresolved).lexically_normal() : canonical).string();
}

Status add_transforms(const fs::path& file, const std::vector<fs::path>& thermal_files,
                      std::map<Modality, KnownViews>& known, Remarks& remarks) {
  ORBITFUSE_ASSIGN(const Transforms transforms, read_transforms_json(file));
  for (const auto& [key, frames] : transforms.unused)
    remarks.add(fmt::format("{}: {} is there in {} of {} frames and is not used{}",
                            file.filename().string(), key, frames, transforms.frames.size(),
                            key == "mask_path" ? ": all of an image is taken" : ""));
  std::set<std::string> thermal;
  for (const fs::path& path : thermal_files) thermal.insert(canonical_name(path));
  std::size_t thermal_frames = 0;
  for (const TransformsFrame& frame : transforms.frames) {
    const fs::path image = resolve(file.parent_path(), frame.file_path);
    const bool is_thermal = thermal.contains(canonical_name(image));
    thermal_frames += is_thermal ? 1 : 0;
    known[is_thermal ? Modality::thermal : Modality::visible].add(
        {image, frame.camera, frame.cam_from_world, {}});
    if (frame.thermal_file_path) {
      known[Modality::thermal].add({resolve(file.parent_path(), *frame.thermal_file_path),
                                    frame.camera,
                                    frame.cam_from_world,
                                    {}});
    }
  }
  if (thermal_frames > 0)
    remarks.add(fmt::format("{}: {} of {} frames are thermal images", file.filename().string(),
                            thermal_frames, transforms.frames.size()));
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

/// How many parts at the ends of two paths are equal: the name, the folder above it, ...
std::size_t common_end(const fs::path& image, const fs::path& view) {
  std::error_code unresolved;
  const fs::path a = fs::absolute(image, unresolved).lexically_normal(),
                 b = view.lexically_normal();
  auto at = a.end(), of = b.end();
  std::size_t common = 0;
  while (at != a.begin() && of != b.begin() && *--at == *--of) ++common;
  return common;
}

bool same_view(const KnownView& a, const KnownView& b) {
  if (!(a.camera == b.camera) || a.cam_from_world.has_value() != b.cam_from_world.has_value())
    return false;
  return !a.cam_from_world || a.cam_from_world->matrix() == b.cam_from_world->matrix();
}

/// Ambiguous: no pose is better than a wrong one.
template <class Map>
typename Map::const_iterator only_largest(const Map& values) {
  auto largest = values.end();
  bool alone = false;
  for (auto at = values.begin(); at != values.end(); ++at) {
    if (largest != values.end() && at->second == largest->second) alone = false;
    if (largest != values.end() && at->second <= largest->second) continue;
    largest = at;
    alone = true;
  }
  return alone ? largest : values.end();
}

}  // namespace

void KnownViews::add(KnownView view) {
  const std::size_t index = views_.size();
  const auto [first, is_new] = by_file_.emplace(canonical_name(view.file), index);
  if (!is_new && same_view(views_[first->second], view)) return;
  if (!is_new) contradicted_.insert(first->first);
  by_name_[view.file.filename().string()].push_back(index);
  by_stem_[view.file.stem().string()].push_back(index);
  views_.push_back(std::move(view));
}

void KnownViews::tell_apart(const std::vector<fs::path>& images) {
  std::map<const KnownView*, std::map<std::string, std::size_t>> rivals;
  for (const fs::path& image : images)
    if (const KnownView* view = find(image))
      rivals[view].emplace(canonical_name(image), common_end(image, view->file));
  for (const auto& [view, of_images] : rivals) {
    if (of_images.size() < 2) continue;
    const auto nearest = only_largest(of_images);
    for (const auto& [image, common] : of_images)
      if (nearest == of_images.end() || image != nearest->first) without_.insert(image);
  }
}

const KnownView* KnownViews::find(const fs::path& file) const {
  const std::string canonical = canonical_name(file);
  if (without_.contains(canonical) || contradicted_.contains(canonical)) return nullptr;
  if (const auto same = by_file_.find(canonical); same != by_file_.end())
    return &views_[same->second];
  for (const auto& [names, name] :
       {std::pair{&by_name_, file.filename().string()}, {&by_stem_, file.stem().string()}}) {
    const auto found = names->find(name);
    if (found == names->end()) continue;
    std::map<std::size_t, std::size_t> common;
    for (const std::size_t index : found->second)
      common[index] = common_end(file, views_[index].file);
    const auto nearest = only_largest(common);
    return nearest == common.end() ? nullptr : &views_[nearest->first];
  }
  return nullptr;
}

std::string KnownViews::ambiguity(const fs::path& file) const {
  if (contradicted_.contains(canonical_name(file)))
    return fmt::format("{} has two different poses", file.string());
  if (without_.contains(canonical_name(file)))
    return fmt::format("{} has the name of another image", file.string());
  const auto named = by_name_.find(file.filename().string());
  if (named == by_name_.end() || named->second.size() < 2 || find(file)) return {};
  std::set<std::string> files;
  for (const std::size_t index : named->second) files.insert(canonical_name(views_[index].file));
  if (files.size() == 1) return fmt::format("{} has two different poses", file.filename().string());
  constexpr std::size_t most_named = 3;
  std::vector<std::string> folders;
  for (const std::size_t index : named->second) {
    const fs::path folder = views_[index].file.parent_path();
    if (folders.size() < most_named) folders.push_back(folder.empty() ? "." : folder.string());
  }
  return fmt::format("{} is there {} times ({}{})", file.filename().string(), named->second.size(),
                     fmt::join(folders, ", "), named->second.size() > most_named ? ", ..." : "");
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

Result<std::map<Modality, KnownViews>> read_known_poses(const ImportOptions& options,
                                                        const std::vector<fs::path>& thermal_files,
                                                        Remarks& remarks) {
  std::map<Modality, KnownViews> known;
  if (options.ground_truth) {
    ORBITFUSE_ASSIGN(known, read_ground_truth_views(*options.ground_truth));
  }
  if (options.transforms_json)
    ORBITFUSE_TRY(add_transforms(*options.transforms_json, thermal_files, known, remarks));
  if (options.visible_colmap)
    ORBITFUSE_TRY(add_colmap(*options.visible_colmap, Modality::visible, known));
  if (options.thermal_colmap)
    ORBITFUSE_TRY(add_colmap(*options.thermal_colmap, Modality::thermal, known));
  return known;
}

}  // namespace orbitfuse
