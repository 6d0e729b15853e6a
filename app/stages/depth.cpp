// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "app/stages/artifacts.hpp"
#include "app/stages/learned_views.hpp"
#include "app/stages/stage_list.hpp"
#include "core/geometry/seen_by_some.hpp"
#include "core/image/image_io.hpp"
#include "core/system/parallel.hpp"
#include "recon/depth/dense_depth.hpp"

namespace orbitfuse::stages {
namespace {
using pipeline::StageContext;
using pipeline::StageOutput;

/// The views that train, and where they stand among all posed ones: held-out views are
/// not matched, so that the geometry they measure comes from the others (their poses and points
/// come from all).
struct TrainingViews {
  Reconstruction model;
  std::vector<int> index;
};

TrainingViews training_views(const LearnedViews& learned, int holdout_every) {
  TrainingViews out;
  std::vector<char> trained(learned.model.views.size(), 1);
  for (std::size_t posed = 0; posed < learned.place.size(); ++posed) {
    if (learned.place[posed] < 0) continue;
    if (holdout_every > 0 && learned.place[posed] % holdout_every == 0)
      trained[static_cast<std::size_t>(learned.place[posed])] = 0;
    else
      out.index.push_back(static_cast<int>(posed));
  }
  out.model = part_of(learned.model, trained);
  return out;
}

Result<StageOutput> estimate(const StageContext& context, const SessionInput& input,
                             const RunConfig& config) {
  ORBITFUSE_ASSIGN(const LearnedViews learned, learned_views(context, Modality::visible));
  const TrainingViews views = training_views(learned, config.train_visible.options.holdout_every);
  std::vector<cv::Mat> images(views.model.views.size());
  std::vector<Status> problems(images.size());
  parallel_for(static_cast<int>(images.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    auto image = read_visible(input.session.folder / views.model.views[k].name);
    if (image)
      images[k] = *std::move(image);
    else
      problems[k] = tl::unexpected(image.error());
  });
  for (const Status& problem : problems) ORBITFUSE_TRY(problem);

  StageOutput output;
  auto found = depth::dense_depth(views.model, images, config.depth, context.progress);
  if (!found && found.error().kind == ErrorKind::quality) {
    // A scene without parallax still has fields to train; they only know less.
    output.skips.push_back(
        {"dense depth", found.error().message(), "fields train from images and sparse points"});
    output.metrics = {{"brief", "none: " + found.error().message()}, {"known", 0.0}};
    ORBITFUSE_TRY(save_depth_maps(context.folder, {}));
    return output;
  }
  if (!found) return tl::unexpected(found.error());
  for (DepthMap& map : found->maps) map.view = views.index[static_cast<std::size_t>(map.view)];
  ORBITFUSE_TRY(save_depth_maps(context.folder, found->maps));
  output.skips = found->report.skips;
  const depth::OpenSpace& open = found->report.open;
  std::string brief = fmt::format("{:.0f} % of the pixels of {} views confirmed by other views",
                                  100 * found->report.known, images.size());
  if (open.ground + open.sky > 0)
    brief += fmt::format(", {:.0f} % open ground, {:.0f} % sky", 100 * open.ground, 100 * open.sky);
  output.metrics = {{"brief", brief},
                    {"known", found->report.known},
                    {"open_ground", open.ground},
                    {"open_sky", open.sky},
                    {"matched", found->report.matched},
                    {"views_without_neighbours", found->report.views_without}};
  return output;
}

}  // namespace

pipeline::Stage depth_stage(const StageInputs& in) {
  pipeline::Stage stage;
  stage.name = "depth";
  stage.version = 6;  // without photos in doubt
  stage.needs = {"poses_visible"};
  stage.options = in.config->settings().to_json("depth");
  stage.options["holdout_every"] = in.config->train_visible.options.holdout_every;
  stage.options["seed"] = in.config->seed;
  stage.inputs_hash = in.session->content.at(Modality::visible);
  stage.run = [in](const StageContext& context) {
    return estimate(context, *in.session, *in.config);
  };
  return stage;
}

}  // namespace orbitfuse::stages
