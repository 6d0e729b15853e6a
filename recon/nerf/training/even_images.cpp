// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/first_names.hpp"
#include "core/geometry/narrowed.hpp"
#include "recon/nerf/rendering/render.hpp"
#include "recon/nerf/training/gray_curves.hpp"
#include "recon/nerf/training/shading.hpp"
#include "recon/nerf/training/training_run.hpp"

// What thermal cameras do to single images is undone where a guide's surfaces say what views share.
namespace orbitfuse::nerf {
namespace {

/// What the guide's surfaces are like from the views that are not left out.
std::vector<DepthMap> depth_from(const FieldState& guide, const Dataset& data,
                                 const std::vector<bool>& left_out) {
  constexpr int width_px = 128;
  RenderOptions coarse;
  coarse.sample_factor = 0.5;
  std::vector<DepthMap> maps;
  for (std::size_t i = 0; i < data.views.size(); ++i) {
    if (left_out[i]) continue;
    const TrainingView& view = data.views[i];
    DepthMap map;
    map.view = static_cast<int>(i);
    map.camera = narrowed_to(view.camera.without_distortion(), width_px);
    map.depth =
        render_strided(guide, ViewRays(map.camera, view.cam_from_world, guide.space), 1, coarse)
            .depth;
    maps.push_back(std::move(map));
  }
  return maps;
}

/// Else there is no one falloff.
bool of_one_lens(const Dataset& data) {
  constexpr double same = 0.05;  // focal lengths
  const Camera& first = data.views[0].camera;
  return std::all_of(data.views.begin(), data.views.end(), [&](const TrainingView& view) {
    const Camera& c = view.camera;
    return c.width == first.width && c.height == first.height &&
           std::abs(c.fx - first.fx) < same * first.fx;
  });
}

std::string names_of(const Dataset& data, const std::vector<std::size_t>& views) {
  std::vector<std::string> names;
  for (const std::size_t v : views) names.push_back(data.views[v].name);
  return first_names(names, 5);
}

/// What curves leave to be known.
void tell_of(const GrayCurves& found, const Dataset& data, std::vector<std::string>& warnings) {
  if (!found.reversed.empty())
    warnings.push_back(names_of(data, found.reversed) +
                       ": hot is shown black, where most frames show it white; these levels were "
                       "turned");
  if (!found.alone.empty())
    warnings.push_back(names_of(data, found.alone) +
                       ": too little of what they show is seen by other frames to say what their "
                       "gray levels mean");
  if (found.contradict())
    warnings.push_back(fmt::format(
        "one place has gray levels {:.0f} of 255 apart in the median, and no curve for each frame "
        "brings them together: the field's levels mean little (are they a palette's colours?)",
        found.left));
}

}  // namespace

void TrainingRun::even_shading(const Field* guide) {
  const auto skip = [&](std::string why) {
    report_.skips.push_back({"even shading", std::move(why), "images are used as they are"});
  };
  if (!options_.shared_geometry)
    return skip("no visible field in the same frame says which points views share");
  if (!of_one_lens(data_.training)) return skip("the views are of several lenses or sizes");
  const Shading shading =
      estimate_shading(data_.dataset, depth_from(guide->state(), data_.dataset, data_.heldout));
  if (!std::isfinite(shading.sigma_k))
    return skip(fmt::format("only {} places are seen by two views", shading.points));
  if (!shading.told())
    return skip(fmt::format("{:+.2f} +- {:.2f} K at the sides of the images, from {} places",
                            shading.falloff_k, shading.sigma_k, shading.points));
  report_.shading_k = shading.falloff_k;
  const double per_kelvin = 1 / (state_->span.high - state_->span.low);
  for (NormalisedView& view : views_)
    view.target -= shading_image(shading.falloff_k * per_kelvin, view.target.size());
}

void TrainingRun::even_levels(const Field* guide) {
  const auto skip = [&](std::string why) {
    report_.skips.push_back({"even levels", std::move(why), "images are used as they are"});
  };
  if (data_.dataset.counts) return skip("raw counts of one sensor have one scale");
  if (!options_.shared_geometry)
    return skip("no visible field in the same frame says which points views share");
  const GrayCurves found = estimate_gray_curves(
      data_.dataset,
      depth_from(guide->state(), data_.dataset, std::vector<bool>(views_.size(), false)),
      data_.heldout);
  if (found.of_view.empty())
    return skip(fmt::format("only {} places are seen by two views", found.points));
  tell_of(found, data_.dataset, report_.warnings);
  const auto bring = [&](std::size_t i, const GrayCurve& curve) {
    const TrainingView& view = data_.dataset.views[i];
    report_.gray_curves[view.name] = curve;
    views_[i].target = normalised(to_common_levels(view.image, curve), state_->span);
  };
  if (found.told()) {
    for (std::size_t i = 0; i < views_.size(); ++i) bring(i, found.of_view[i]);
    return;
  }
  GrayCurve turned;
  for (std::size_t k = 0; k < turned.size(); ++k)
    turned[k] = 255.0 * (1 - static_cast<double>(k) / static_cast<double>(turned.size() - 1));
  for (const std::size_t view : found.reversed) bring(view, turned);
  if (found.flattened())
    return skip(
        fmt::format("the curves that bring {} shared places together leave {:.0f} % of "
                    "what each view tells apart",
                    found.points, 100 * found.slope));
  skip(fmt::format("levels of {} shared places are {:.1f} of 255 from their mean in the median",
                   found.points, found.before));
}

}  // namespace orbitfuse::nerf
