// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <opencv2/imgproc.hpp>

#include "app/stages/artifacts.hpp"
#include "app/stages/explained_share.hpp"
#include "app/stages/metric_tables.hpp"
#include "app/stages/recorded_detail.hpp"
#include "app/stages/rendered_views.hpp"
#include "app/stages/stage_list.hpp"
#include "core/image/image_io.hpp"
#include "core/numeric/percent.hpp"
#include "core/system/file_io.hpp"
#include "core/system/side_by_side.hpp"
#include "recon/assembly/training_data.hpp"
#include "recon/nerf/nerf.hpp"

namespace orbitfuse::stages {
namespace {
using nlohmann::json;
using pipeline::StageContext;
using pipeline::StageOutput;

/// Errors of cameras rather than of fields: kelvin, shares of white.
constexpr double noise_k = 0.5, noise_colour = 0.02;

/// Mean absolute difference where both images have a value.
struct MeanError {
  double sum = 0;
  int count = 0;
  void add(const cv::Mat& truth, const cv::Mat& rendered) {
    cv::Mat difference;
    cv::absdiff(truth, rendered, difference);
    const cv::Mat valid = difference == difference;
    sum += cv::sum(cv::Mat(difference.mul(1)).setTo(0, ~valid))[0];
    count += cv::countNonZero(valid);
  }
  double mean() const { return sum / count; }
};

/// What held-out frames say of the fields.
struct HeldoutScores {
  MetricMeans means;
  MeanError field_alone_k, shown_k;  ///< without and with detail; a planner expects the field's
  std::map<Modality, ExplainedShare> explained;
};

/// Rendered, with the detail of all other recorded views, against recorded, on views that did not
/// train (as Table 4 of the paper that fusion/metrics/metrics.hpp names).
Status score_field(const StageContext& context, const StageInputs& in, Modality modality,
                   HeldoutScores& scores) {
  const SessionInput& input = *in.session;
  const TrainConfig& config = in.config->train(modality);
  const std::string train = "train_" + std::string(name(modality));
  if (!context.has(train)) return {};
  ORBITFUSE_ASSIGN(const TrainedFrames trained, load_trained_frames(context.of(train)));
  const std::vector<std::string>& heldout = trained.heldout;
  if (heldout.empty()) return {};
  ORBITFUSE_ASSIGN(Reconstruction model, load_trained_poses(context, modality));
  model.points.clear();
  std::erase_if(model.views, [&](const PosedView& v) {
    return std::find(heldout.begin(), heldout.end(), v.name) == heldout.end();
  });
  ORBITFUSE_ASSIGN(const nerf::Dataset data,
                   training_data(input.session.folder, model, input.samples(model.modality),
                                 config.max_width_px, context.progress));
  ORBITFUSE_ASSIGN(const nerf::Field field, nerf::Field::load(context.of(train) / field_file));
  ORBITFUSE_ASSIGN(nerf::PhotoDetail detail,
                   detail_of_new_views(context, input.session, modality, config.max_width_px,
                                       in.where_frames_stand));
  for (const nerf::TrainingView& view : data.views) {
    ORBITFUSE_ASSIGN(nerf::RenderedView seen,
                     nerf::render(field, view.camera, view.cam_from_world, {}, context.progress));
    const cv::Mat field_alone = seen.color.clone();
    ORBITFUSE_TRY(
        detail.add(field, view.camera, view.cam_from_world, seen, context.progress, view.name));
    cv::Mat truth = view.image, rendered = seen.color;
    double dead_share = 0;
    if (const auto curve = trained.gray_curves.find(view.name); curve != trained.gray_curves.end())
      truth = nerf::to_common_levels(truth, curve->second);
    if (modality == Modality::visible) {
      // The field shows the common exposure, the frame its own.
      if (const auto found = trained.gains.find(view.name); found != trained.gains.end()) {
        const std::array<double, 3>& gain = found->second;
        cv::multiply(rendered, cv::Scalar(gain[0], gain[1], gain[2]), rendered);
      }
      scores.explained[modality].add(truth, rendered);
      truth.convertTo(truth, CV_8U, 255);
      rendered.convertTo(rendered, CV_8U, 255);
    } else {
      // The frame's lens shows what the field is without.
      const cv::Mat shading = nerf::shading_image(trained.shading_k, rendered.size());
      rendered = rendered + shading;
      if (input.has_temperatures()) {  // what gray levels are off by says nothing where they clip
        scores.explained[modality].add(truth, rendered);
        scores.shown_k.add(truth, rendered);
        scores.field_alone_k.add(truth, field_alone + shading);
      }
      const TemperatureSpan span = common_span({truth}, 0, 100);
      const cv::Mat dead = truth != truth;
      dead_share = cv::countNonZero(dead) / static_cast<double>(dead.total());
      truth = gray_of_kelvin(truth, span);
      rendered = gray_of_kelvin(rendered, span).setTo(0, dead);
    }
    if (dead_share == 1) continue;
    ORBITFUSE_ASSIGN(auto values, render_metrics(truth, rendered));
    take_out_alike(dead_share, values);
    scores.means.add(std::string(name(modality)), view.name, values);
  }
  return {};
}

/// The fused views, or `scored_views` of them (Table 7). Returns how many are left out.
Result<std::size_t> score_fused(const StageContext& context, int scored_views, MetricMeans& means) {
  if (!context.has("fuse") || !context.has("render")) return 0;
  ORBITFUSE_ASSIGN(const FusedImages fused, load_fused_images(context.of("fuse")));
  const std::vector<std::string>& methods = fused.methods;
  ORBITFUSE_ASSIGN(const RenderedViews rendered, load_rendered_views(context.of("render")));
  const std::size_t all = rendered.views.size();
  const std::size_t scored =
      scored_views > 0 ? std::min(all, static_cast<std::size_t>(scored_views)) : all;
  for (std::size_t i = 0; i < scored; ++i) {
    const ViewFiles& files = rendered.views[i * all / scored];
    ORBITFUSE_TRY(context.progress.check("metrics"));
    context.progress.report(
        {"metrics", static_cast<double>(i), static_cast<double>(scored), {}, files.name});
    cv::Mat visible, thermal;
    std::vector<cv::Mat> images(methods.size());
    std::vector<std::function<Status()>> reads;
    const auto read = [&](const std::filesystem::path& file, cv::Mat& image) {
      reads.emplace_back([file, &image]() -> Status {
        ORBITFUSE_ASSIGN(image, read_image(file));
        return {};
      });
    };
    const std::string png = files.name + ".png";
    read(context.of("render") / files.visible, visible);
    read(context.of("fuse") / "thermal" / png, thermal);
    for (std::size_t m = 0; m < methods.size(); ++m)
      read(context.of("fuse") / methods[m] / png, images[m]);
    ORBITFUSE_TRY(side_by_side(reads));
    ORBITFUSE_ASSIGN(const auto values, fusion_metrics(visible, thermal, images));
    for (std::size_t m = 0; m < methods.size(); ++m) means.add(methods[m], files.name, values[m]);
  }
  return all - scored;
}

/// Share of the fused views that has a temperature; null where nothing was fused.
Result<json> measured_share(const StageContext& context) {
  if (!context.has("fuse")) return json();
  ORBITFUSE_ASSIGN(const FusedImages fused, load_fused_images(context.of("fuse")));
  return fused.measured_share;
}

std::string poor_field_words(Modality modality, double explained) {
  return fmt::format(
      "the {0} field is poor: frames kept from training show it to have {1} of what varies in "
      "them (of a good one, over 80 %), so that new views between the recorded ones are not to be "
      "believed; more frames all round (one every 30 degrees or closer) help, and sharp ones of a "
      "scene that stands still",
      name(modality), explained > 0 ? percent(explained) : "nothing");
}

Result<StageOutput> score(const StageContext& context, const StageInputs& in) {
  const MetricsConfig& config = in.config->metrics;
  MetricMeans fused;
  HeldoutScores heldout;
  for (const Modality modality : {Modality::visible, Modality::thermal})
    ORBITFUSE_TRY(score_field(context, in, modality, heldout));
  const MetricMeans& fields = heldout.means;
  ORBITFUSE_ASSIGN(const std::size_t unscored, score_fused(context, config.scored_views, fused));
  StageOutput output;
  if (unscored > 0)
    output.skips.push_back({fmt::format("fusion metrics of {} new views", unscored),
                            fmt::format("metrics.scored_views = {}", config.scored_views),
                            "the means are of the others"});
  auto tables = json::array();
  if (!fields.empty())
    tables.push_back(fields.table("Rendered views against held-out frames", "field"));
  if (!fused.empty())
    tables.push_back(fused.table(
        unscored > 0
            ? fmt::format("Fused views, mean over {} of the new cameras", config.scored_views)
            : "Fused views, mean over the new cameras",
        "method"));
  ORBITFUSE_TRY(write_file_atomic(context.folder / "metrics.csv",
                                  MetricMeans::csv_header() + fields.csv() + fused.csv()));
  ORBITFUSE_ASSIGN(const json share, measured_share(context));
  ORBITFUSE_TRY(write_json(context.folder / "metrics.json", {{"schema", 1},
                                                             {"fields", fields.to_json()},
                                                             {"fused", fused.to_json()},
                                                             {"measured_share", share}}));
  output.metrics = {
      {"brief", fmt::format("{} fused images, {} held-out views", fused.count(), fields.count())},
      {"tables", tables},
      {"fields", fields.to_json()},
      {"fused", fused.to_json()}};
  if (heldout.shown_k.count > 0) {
    output.metrics["thermal_heldout_mae_k"] = heldout.shown_k.mean();
    output.metrics["thermal_heldout_field_mae_k"] = heldout.field_alone_k.mean();
  }
  for (const auto& [modality, explained] : heldout.explained) {
    output.metrics[fmt::format("{}_heldout_explained", name(modality))] = explained.share();
    if (explained.is_poor(modality == Modality::visible ? noise_colour : noise_k))
      output.warnings.push_back(poor_field_words(modality, explained.share()));
  }
  return output;
}

}  // namespace

pipeline::Stage metrics_stage(const StageInputs& in) {
  pipeline::Stage stage;
  stage.name = "metrics";
  stage.version = 9;  // dead pixels say nothing
  stage.options = in.config->settings().to_json("metrics");
  stage.uses = {"poses_visible", "poses_thermal", "train_visible",
                "train_thermal", "render",        "fuse"};
  stage.absent = [](const StageContext& context) -> std::optional<std::string> {
    if (context.has("train_visible") || context.has("train_thermal")) return std::nullopt;
    return "no field was trained";
  };
  stage.run = [in](const StageContext& context) {
    auto scored = score(context, in);
    *in.where_frames_stand = {};  // nobody asks for them after this
    return scored;
  };
  return stage;
}

}  // namespace orbitfuse::stages
