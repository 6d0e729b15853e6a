// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/camera_groups.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace orbitfuse {
namespace {

/// A focal length in other units than pixels shows as an angle that no lens has: 1200 mm before a
/// sensor of 36 mm span 1.7 degrees.
Status check_angle(const std::optional<double>& focal_px, const StillPhoto& still,
                   const std::string& where) {
  double angle_deg = 0;
  if (!focal_px || is_of_a_lens(*focal_px, still.size, &angle_deg)) return {};
  return fail(ErrorKind::usage, where,
              fmt::format("a focal length of {:g} px, with which the {} pixels of {} span {:.3g} "
                          "degrees",
                          *focal_px, std::max(still.size.width, still.size.height),
                          still.described(), angle_deg),
              "give it in pixels: millimetres times the image's width in pixels, by the sensor's "
              "in millimetres");
}

}  // namespace

Result<CameraGroup*> CameraGroups::of(StillPhoto& still, const Source& source) {
  const Modality modality = still.camera.modality;
  const auto& focal =
      modality == Modality::visible ? options_.visible_focal_px : options_.thermal_focal_px;
  ORBITFUSE_TRY(check_angle(focal, still, fmt::format("--{}-focal-px", name(modality))));
  if (focal) still.camera.lens.focal_px = focal;
  const std::string key = still.key();
  for (CameraGroup& group : groups_) {
    if (group.modality != modality) continue;
    if (group.key == key && group.size == still.size) return &group;
    if (focal && group.key != key) {
      return fail(
          ErrorKind::input, source.short_name(),
          fmt::format("is of {}, but {} of {}", still.described(), group.first_file,
                      group.described),
          fmt::format("one focal length of {:g} px is not true of both: import them one by one, "
                      "or leave the option away",
                      *focal));
    }
  }
  groups_.push_back({modality, key, still.size, still.described(), source.short_name(), {}, 0});
  return &groups_.back();
}

std::string CameraGroups::next_device_id(Modality modality) const {
  const auto known = std::count_if(groups_.begin(), groups_.end(), [&](const CameraGroup& group) {
    return group.modality == modality && !group.id.empty();
  });
  return fmt::format("{}{}", name(modality), known);
}

std::optional<std::string> CameraGroups::described(Modality modality) const {
  constexpr std::size_t most_named = 6;
  std::vector<std::string> list;
  std::size_t count = 0;
  for (const CameraGroup& group : groups_) {
    if (group.modality == modality && ++count <= most_named)
      list.push_back(fmt::format("{} from {} ({})", group.id, group.first_file, group.described));
  }
  if (count < 2) return std::nullopt;
  if (count > most_named) list.push_back(fmt::format("and {} more", count - most_named));
  return fmt::format(
      "{}: {} cameras, lenses or image sizes, each calibrated on its own: {}; leave out what is "
      "not of this orbit",
      name(modality), count, fmt::join(list, "; "));
}

}  // namespace orbitfuse
