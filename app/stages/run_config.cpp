// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/run_config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "core/image/palette.hpp"
#include "core/nested_text.hpp"
#include "core/option_range.hpp"

namespace orbitfuse::stages {
namespace {
using config::Setting;
using config::Settings;
using nlohmann::json;

/// Set by the run, not by a preset's user.
constexpr const char* run_owned[] = {"preset", "seed", "checkpoint", "resume"};

/// Every field of the training recipe by its own name.
void add_train_fields(Settings& settings, const std::string& table, nerf::TrainOptions& options) {
  for (const std::string& key : nerf::TrainOptions::keys()) {
    if (std::count(std::begin(run_owned), std::end(run_owned), key) > 0) continue;
    Setting setting;
    setting.key = table + "." + key;
    setting.type = nerf::TrainOptions::allowed(key);
    setting.doc = "Of the recipe, which has another value";
    setting.listed = [&options, key] {
      const auto recipe = nerf::preset(options.preset);
      return !recipe || recipe->get(key) != options.get(key);
    };
    setting.get = [&options, key] {
      const std::string text = options.get(key);
      const json value = parse_json(text);
      return value.is_discarded() ? json(text) : value;
    };
    setting.set = [&options, key](const json& value) {
      return options.set(key, value.is_string() ? value.get<std::string>() : value.dump())
          .has_value();
    };
    settings.add(std::move(setting));
  }
}

void add_train(Settings& settings, const std::string& table, TrainConfig& config) {
  std::string presets = "one of";
  for (const std::string& name : nerf::preset_names()) presets += " " + name;
  settings.add({table + ".preset", "Training recipe; its fields may follow, e.g. iterations = 8000",
                presets, [&config] { return json(config.options.preset); },
                [&config](const json& value) {
                  if (!value.is_string()) return false;
                  auto options = nerf::preset(value.get<std::string>());
                  if (!options) return false;
                  config.options = *std::move(options);
                  return true;
                }});
  settings.add(table + ".max_width_px", config.max_width_px,
               "Training images are reduced to this width");
  settings.add(table + ".cloud_width_px", config.cloud.max_width,
               "Width of the depth maps the point cloud is made from");
  settings.add(table + ".cloud_tolerance", config.cloud.depth_tolerance,
               "Relative depth agreement of two views on a point of the cloud");
  add_train_fields(settings, table, config.options);
}

void add_poses(Settings& settings, PoseOptions& poses) {
  settings.add("poses.colmap", poses.colmap, "COLMAP's command");
  settings.add("poses.use_known_poses", poses.use_known_poses,
               "Poses that the session carries replace the estimate");
  settings.add("poses.check_known_poses", poses.check_known_poses,
               "Such poses are held against the images first");
  settings.add("poses.check_mirrored", poses.check_mirrored,
               "Thermal images that fit better mirrored left to right are refused");
  settings.add("poses.use_tracking_frames", poses.use_tracking_frames,
               "Thermal frames recorded between stations tie neighbours together");
  settings.add("poses.max_image_side_px", poses.max_image_side_px,
               "Longest image side given to COLMAP");
  settings.add("poses.max_features", poses.max_features, "SIFT features a view");
  settings.add("poses.min_posed_ratio", poses.min_posed_ratio,
               "Below this share of posed views the next method is tried; of photos 0.7 have to do "
               "where none finds more and stations confirm them, unless above 0.8 are asked for");
  settings.add("poses.max_reprojection_rms_px", poses.max_reprojection_rms_px,
               "Above this error a model is not believed");
  settings.add(
      "poses.max_station_residual", poses.max_station_residual,
      "A model that leaves the stations' orbit by more (share of the radius) is not believed");
}

void add_depth(Settings& settings, depth::DepthOptions& depth) {
  settings.add("depth.width_px", depth.width_px, "Width of the visible views' depth maps");
  settings.add("depth.neighbours", depth.neighbours, "Views each view is matched with");
  settings.add("depth.best_neighbours", depth.best_neighbours, "Of these, the best so many count");
  settings.add("depth.coarse_iterations", depth.coarse_iterations,
               "At half width, from random planes");
  settings.add("depth.fine_iterations", depth.fine_iterations, "At full width");
  settings.add("depth.max_cost", depth.max_cost, "1 - NCC above which a match is none");
  settings.add("depth.agreement", depth.agreement,
               "Relative difference below which two views agree");
  settings.add("depth.min_agreeing", depth.min_agreeing, "Views that must agree with a depth");
  settings.add("depth.ground", depth.ground,
               "Open ground and sky, which nothing confirms, get the depth of the plane under the "
               "object and an infinite one");
}

void add_render(Settings& settings, RenderConfig& render) {
  settings.add_choice(
      "render.path", render.path.path,
      {{PathKind::automatic, "auto"}, {PathKind::orbit, "orbit"}, {PathKind::path, "path"}},
      "New cameras on an orbit, between the recorded ones, or whichever suits the scene");
  settings.add("render.views", render.path.views, "New cameras along the path");
  settings.add("render.width_px", render.path.width_px, "Width of a rendered image");
  settings.add("render.azimuth_deg", render.path.azimuth_deg,
               "First new camera, from the first recorded one");
  settings.add("render.elevation_deg", render.path.elevation_deg,
               "Of an orbit; auto: the median of the recorded cameras");
  settings.add("render.radius_scale", render.path.radius_scale,
               "Of an orbit, times the recorded cameras' median distance");
  settings.add("render.palette", render.palette, "Colours of temperatures");
  settings.add("render.thermal_alike", render.thermal.alike,
               "Share of the temperatures' span within which four neighbours stand for the pixel "
               "between them; 0: every pixel is rendered");
  settings.add("render.detail_sources", render.detail.sources,
               "Recorded views that lend each new one the detail its field lacks; 0: none");
  settings.add("render.min_opacity", render.min_opacity,
               "Pixels less opaque than this have no temperature and are not fused");
}

void add_fuse(Settings& settings, FuseConfig& fuse) {
  settings.add(
      "fuse.methods", fuse.methods,
      fmt::format("Any of {}; the first is shown first", fmt::join(fusion_method_names(), ", ")));
  settings.add("fuse.color", fuse.options.color, "Keep the visible colours; false: gray");
  settings.add("fuse.heat_palette", fuse.options.heat.palette,
               "Colours of what is warmer than its surroundings");
  settings.add("fuse.heat_opacity", fuse.options.heat.opacity,
               "0..1: of the colour where it is hottest");
  settings.add("fuse.heat_shading", fuse.options.heat.shading,
               "0..1: share of the colour's brightness that follows the visible picture");
  settings.add("fuse.heat_hatching", fuse.options.heat.hatching,
               "0..1: contrast of the hatching where nothing was measured");
  settings.add("fuse.overlay_palette", fuse.options.overlay.palette,
               "Palette whose hue tells the temperature in the fused image; empty: none");
  settings.add("fuse.overlay_strength", fuse.options.overlay.strength,
               "0..1: its colour against the visible one");
  settings.add("fuse.best_levels", fuse.options.best.levels, "Pyramid levels of best");
  settings.add("fuse.best_sharpness", fuse.options.best.sharpness,
               "How hard best chooses between details");
  settings.add("fuse.best_contrast_kept", fuse.options.best.contrast_kept,
               "0..1: how far a detail's strength follows the level it moves to");
  settings.add("fuse.best_visible_preference", fuse.options.best.visible_preference,
               "Gray levels of structure the visible image has for free where neither has any");
  settings.add("fuse.best_brightness_weight", fuse.options.best.brightness_weight,
               "Share of brightness that counts as structure; 0 for black-hot thermal images");
  settings.add("fuse.ms_srif_stride_px", fuse.options.ms_srif.stride_px,
               "Between patches of MS-SRIF's base");
  settings.add("fuse.ms_srif_relative_residual", fuse.options.ms_srif.relative_residual,
               "Share of a patch's norm at which its code ends; 0 = the reference's stop");
  settings.add("fuse.ms_srif_certain_ratio", fuse.options.ms_srif.certain_ratio,
               "Where one patch has so many times the other's structure no code is sought; 0: "
               "always sought");
  settings.add("fuse.pca_msif_iterations", fuse.options.pca_msif.smoother.iterations,
               "Diffusion time of PCA-MSIF, in time steps");
  settings.add("fuse.pca_msif_time_step", fuse.options.pca_msif.smoother.time_step,
               "At most 1: beyond it the diffusion diverges");
  settings.add("fuse.pca_msif_cycles", fuse.options.pca_msif.smoother.cycles,
               "Cycles of fast explicit diffusion that reach that time; 0: plain steps");
  settings.add("fuse.cnn_lpif_network_bands", fuse.options.cnn_lpif.network_bands,
               "Finest bands in which the network also weighs where the sources disagree");
  settings.add("fuse.cnn_lpif_network_halvings", fuse.options.cnn_lpif.network_halvings,
               "Times the images are halved for the network; each makes it four times faster");
  settings.add("fuse.cnn_lpif_vote_px", fuse.options.cnn_lpif.vote_px,
               "Side of the square over which those decisions are averaged; odd");
  settings.add("fuse.cnn_lpif_same_within", fuse.options.cnn_lpif.same_within,
               "Gray levels up to which the sources count as equal and the network is not asked");
  settings.add(
      "fuse.cnn_lpif_flat_within", fuse.options.cnn_lpif.flat_within,
      "Gray levels within which a patch is flat and the network is not asked; -1: always asked");
}

/// "pca_msif.smoother.cycles" as add_fuse() calls it.
Error as_fuse_key(Error error) {
  std::string key = error.where;
  if (const auto at = key.find(".smoother"); at != std::string::npos) key.erase(at, 9);
  std::replace(key.begin(), key.end(), '.', '_');
  if (key == "palette") key = "heat_palette or fuse.overlay_palette";
  error.where = "fuse." + key;
  return error;
}

}  // namespace

Result<std::vector<FusionMethod>> FuseConfig::chosen() const {
  std::vector<FusionMethod> result;
  for (const std::string& name : methods) {
    ORBITFUSE_ASSIGN(const FusionMethod method, fusion_method(name).map_error([](Error error) {
      error.where = "fuse.methods";
      return error;
    }));
    if (std::count(result.begin(), result.end(), method) > 0)
      return fail(ErrorKind::usage, "fuse.methods", "'" + name + "' twice", "name each once");
    result.push_back(method);
  }
  if (result.empty())
    return fail(ErrorKind::usage, "fuse.methods", "empty", "name at least one method");
  return result;
}

RunConfig::RunConfig() {
  train_visible.options = nerf::preset(nerf::default_preset(Modality::visible)).value();
  train_thermal.options = nerf::preset(nerf::default_preset(Modality::thermal)).value();
  // A run shows held-out error, and fits into a few minutes on two cores; docs/notes/run.md.
  for (TrainConfig* train : {&train_visible, &train_thermal}) train->options.holdout_every = 12;
  train_visible.options.iterations = 4800;
  train_thermal.options.iterations = 2400;
  // Thermal views have little texture: on their own they become fog.
  train_thermal.options.shared_geometry = true;
}

void RunConfig::set_seed(std::uint64_t value) {
  seed = poses.seed = depth.seed = train_visible.options.seed = train_thermal.options.seed = value;
}

Status RunConfig::validate() const {
  ORBITFUSE_TRY(poses.validate());
  ORBITFUSE_TRY(depth.validate());
  for (const TrainConfig* train : {&train_visible, &train_thermal}) {
    const std::string table = train == &train_visible ? "train.visible" : "train.thermal";
    ORBITFUSE_TRY(train->options.validate().map_error([&](Error error) {
      // Named as the user wrote it.
      if (error.where.starts_with("nerf.")) error.where = table + error.where.substr(4);
      return error;
    }));
    if (train->options.target_psnr > 0 && train->options.holdout_every == 0)
      return fail(ErrorKind::usage, table + ".target_psnr", "no view is held out to measure it",
                  "hold some out, e.g. --set " + table + ".holdout_every=12");
    ORBITFUSE_TRY(train->cloud.validate());
    ORBITFUSE_TRY(OptionCheck(table)("max_width_px", train->max_width_px, at_least(16)));
  }
  if (const int width = train_thermal.depth_width_px; width != 0 && (width < 32 || width > 8192))
    return fail(ErrorKind::usage, "train.thermal.depth_width_px", std::to_string(width),
                "choose 0 (none) or 32..8192");
  ORBITFUSE_TRY(render.path.validate());
  ORBITFUSE_TRY(render.visible.validate());
  ORBITFUSE_TRY(render.thermal.validate());
  ORBITFUSE_TRY(render.detail.validate().map_error([](Error error) {
    error.where = "render.detail_" + error.where.substr(std::string_view("detail.").size());
    return error;
  }));
  ORBITFUSE_TRY(palette(render.palette));
  ORBITFUSE_TRY(fuse.chosen());
  ORBITFUSE_TRY(fuse.options.validate().map_error(as_fuse_key));
  ORBITFUSE_TRY(OptionCheck("metrics")("scored_views", metrics.scored_views, at_least(0)));
  return OptionCheck("render")("min_opacity", render.min_opacity, from_to(0, 1));
}

Settings RunConfig::settings() {
  Settings settings;
  add_poses(settings, poses);
  add_depth(settings, depth);
  add_train(settings, "train.visible", train_visible);
  add_train(settings, "train.thermal", train_thermal);
  settings.add(
      "train.thermal.depth_width_px", train_thermal.depth_width_px,
      "Depth maps matched in thermal views where no visible field gives the geometry; 0: none");
  add_render(settings, render);
  add_fuse(settings, fuse);
  settings.add("metrics.scored_views", metrics.scored_views,
               "New views whose fused pictures are measured; 0: all");
  return settings;
}

}  // namespace orbitfuse::stages
