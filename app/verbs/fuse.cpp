// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/fuse/fuse.hpp"

#include <fmt/format.h>

#include <cctype>

#include "app/cli/option_pairs.hpp"
#include "app/cli/run_stages.hpp"
#include "app/cli/verb.hpp"
#include "app/fusion_batch/fusion_batch.hpp"
#include "app/pipeline/out_folder.hpp"
#include "core/image/image_io.hpp"
#include "fusion/heat/legend.hpp"

namespace orbitfuse::cli {
namespace {
namespace fs = std::filesystem;

struct FuseArguments {
  StageFolders folders;
  std::string visible, thermal, mask, method = "heat";
  bool gray = false, out_given = false, method_given = false;
};

using ImageWriter = Status (*)(const fs::path&, const cv::Mat&);

/// By the extension; null for one that is not written.
ImageWriter image_writer(const fs::path& file) {
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (extension == ".png")
    return [](const fs::path& to, const cv::Mat& image) { return write_png(to, image); };
  if (extension == ".jpg" || extension == ".jpeg")
    return [](const fs::path& to, const cv::Mat& image) { return write_jpeg(to, image); };
  return nullptr;
}

Result<cv::Mat> read_optional(const std::string& file) {
  return file.empty() ? Result<cv::Mat>(cv::Mat()) : read_image(file);
}

bool same_file(const fs::path& a, const fs::path& b) {
  std::error_code missing;
  return !a.empty() && !b.empty() && fs::equivalent(a, b, missing);
}

/// Beside the picture.
fs::path legend_file(const fs::path& out) {
  return out.parent_path() / (out.stem().string() + "_legend.png");
}

/// What to write, told by the name; the user says where, and never onto an input.
Status check_image_out(const FuseArguments& o) {
  if (!o.out_given)
    return fail(ErrorKind::usage, "--out", "not given",
                "name the image to write, e.g. --out fused.png");
  if (!image_writer(o.folders.out))
    return fail(ErrorKind::usage, "--out " + o.folders.out, "no name of a PNG or JPEG",
                "end it in .png or .jpg");
  const bool legend = o.method == "heat";
  for (const std::string& input : {o.visible, o.thermal, o.mask}) {
    if (same_file(o.folders.out, input))
      return fail(ErrorKind::usage, "--out " + o.folders.out, "is an input too",
                  "give another name");
    if (legend && same_file(legend_file(o.folders.out), input))
      return fail(ErrorKind::usage, "--out " + o.folders.out,
                  "its legend would be written onto the input " + input, "give another name");
  }
  if (legend) ORBITFUSE_TRY(pipeline::check_out_file(legend_file(o.folders.out)));
  return pipeline::check_out_file(o.folders.out);
}

/// Pairs go to vi/, ir/ and fused/ below --out.
Status check_folder_out(const FuseArguments& o) {
  if (!o.out_given)
    return fail(ErrorKind::usage, "--out", "not given", "name the folder for the fused pairs");
  for (const std::string& input : {o.visible, o.thermal})
    for (const char* part : {"", "vi", "ir", "fused"})
      if (same_file(fs::path(o.folders.out) / part, input))
        return fail(ErrorKind::usage, "--out " + o.folders.out,
                    "would write into the input " + input, "give another folder");
  return pipeline::check_out_folder(o.folders.out);
}

/// The bar of what heat's colours stand for.
Status write_legend(Context& context, const fs::path& out, const cv::Mat& thermal,
                    const FusionOptions& options, const FusionReport& said, int width) {
  const auto unit = thermal.depth() == CV_32F ? fusion::HeatUnit::kelvin : fusion::HeatUnit::gray;
  ORBITFUSE_ASSIGN(const cv::Mat legend,
                   fusion::heat_legend({*said.heat, unit, options.heat}, width));
  const fs::path file = legend_file(out);
  context.console.detail("what the colours stand for: " + file.string());
  context.result["legend"] = file.string();
  return write_png(file, legend);
}

Status fuse_pair(Context& context, const FuseArguments& o, const FusionOptions& options) {
  ORBITFUSE_TRY(check_image_out(o));
  ORBITFUSE_ASSIGN(const cv::Mat visible, batch::read_photo(o.visible));
  ORBITFUSE_ASSIGN(const cv::Mat thermal, batch::read_thermal(o.thermal));
  if (const auto remark = batch::looks_exchanged(visible, thermal, o.visible))
    context.console.warning(*remark);
  if (const auto remark = batch::in_colors(thermal, o.thermal)) context.console.warning(*remark);
  ORBITFUSE_ASSIGN(const cv::Mat mask, read_optional(o.mask));
  for (const std::string& file : {o.visible, o.thermal})
    for (const std::string& remark : batch::unused_parts(file)) context.console.warning(remark);
  FusionReport said;
  ORBITFUSE_ASSIGN(
      const cv::Mat fused, fuse(visible, thermal, mask, options, &said).map_error([&](Error error) {
        return batch::with_file(std::move(error),
                                {{"visible", o.visible}, {"thermal", o.thermal}, {"mask", o.mask}});
      }));
  if (context.common.dry_run) {
    context.console.info("would write " + o.folders.out);
    return {};
  }
  ORBITFUSE_TRY(image_writer(o.folders.out)(o.folders.out, fused));
  context.console.data(o.folders.out);
  context.result = {
      {"out", o.folders.out}, {"method", name(options.method)}, {"ms", 1000 * said.wall_s}};
  if (said.heat)
    ORBITFUSE_TRY(write_legend(context, o.folders.out, thermal, options, said, fused.cols));
  context.result["measured_share"] = 1 - said.unmeasured;
  context.result["skips"] = nlohmann::json::array();
  for (const Skip& skip : said.skips) {
    context.result["skips"].push_back(
        {{"what", skip.what}, {"why", skip.why}, {"effect", skip.effect}});
    context.console.detail(fmt::format("skipped {}: {}; {}", skip.what, skip.why, skip.effect));
  }
  return {};
}

Status fuse_folder(Context& context, const FuseArguments& o, const FusionOptions& options) {
  ORBITFUSE_TRY(check_folder_out(o));
  if (context.common.dry_run) {
    context.console.info("would write fused pairs below " + o.folders.out);
    return {};
  }
  ORBITFUSE_ASSIGN(
      const batch::Summary summary,
      batch::fuse_folder(o.visible, o.thermal, o.folders.out, options, context.progress));
  for (const auto* list : {&summary.problems, &summary.remarks})
    for (const std::string& told : *list) context.console.warning(told);
  context.console.data(fmt::format("{} pairs fused, {} problems; {}", summary.fused,
                                   summary.problems.size(),
                                   (fs::path(o.folders.out) / batch::metrics_file).string()));
  context.result = {
      {"out", o.folders.out}, {"fused", summary.fused}, {"problems", summary.problems}};
  return {};
}

Status run(Context& context, const FuseArguments& o) {
  if (o.visible.empty() && o.thermal.empty()) {
    // A run's pictures have methods, masks and colours of their own.
    constexpr const char* files = "--visible and --thermal";
    ORBITFUSE_TRY(check_needs({{"--mask", !o.mask.empty(), files, false},
                               {"--gray", o.gray, files, false},
                               {"--method", o.method_given, files, false}}));
    std::error_code no_file;
    if (fs::is_regular_file(o.folders.session, no_file))
      return fail(ErrorKind::usage, o.folders.session, "a file, where a session is named",
                  "name images by options: --visible FILE --thermal FILE --out FUSED.png");
    return run_stages(context, o.folders, {"fuse"});
  }
  for (const auto& [option, value] :
       {std::pair{"--visible", &o.visible}, {"--thermal", &o.thermal}})
    if (value->empty())
      return fail(ErrorKind::usage, option, "not given", "name both images, or both folders");
  std::error_code unreadable;  // whoever reads it says why
  const bool folders = fs::is_directory(o.visible, unreadable);
  ORBITFUSE_TRY(
      check_apart({{"session", !o.folders.session.empty(), "--visible and --thermal", true},
                   {"--mask", !o.mask.empty(), "folders of images", folders}}));
  if (same_file(o.visible, o.thermal))
    return fail(ErrorKind::usage, "--thermal " + o.thermal, "is --visible too",
                "name the thermal one");
  FusionOptions options = context.config.fuse.options;
  ORBITFUSE_ASSIGN(options.method, fusion_method(o.method));
  options.color = !o.gray;
  if (folders) return fuse_folder(context, o, options);
  return fuse_pair(context, o, options);
}

}  // namespace

Action add_fuse(CLI::App& app) {
  const auto options = std::make_shared<FuseArguments>();
  add_folders(app, options->folders);
  app.add_option("--visible", options->visible, "Visible image, or a folder of them");
  app.add_option("--thermal", options->thermal,
                 "Thermal image of the same size, or a folder with the same names");
  app.add_option("--mask", options->mask, "Gray image, 0 where the thermal image holds nothing");
  app.add_option("--method", options->method, "For files; a session fuses by fuse.methods")
      ->check(CLI::IsMember(fusion_method_names()))
      ->capture_default_str();
  app.add_flag("--gray", options->gray, "Fuse to gray instead of keeping the visible colours");
  return [options, &app](Context& context) -> Status {
    options->out_given = app.count("--out") > 0;
    options->method_given = app.count("--method") > 0;
    if (!options->visible.empty() || !options->thermal.empty())
      ORBITFUSE_TRY(
          check_unused(app, {"--force", "--resume", "--seed"}, "--visible and --thermal"));
    return run(context, *options);
  };
}

}  // namespace orbitfuse::cli
