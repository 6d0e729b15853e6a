// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/colmap.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <map>
#include <tuple>

#include "core/formats/colmap_model.hpp"
#include "core/image/image_io.hpp"
#include "core/system/file_io.hpp"
#include "core/system/parallel.hpp"
#include "core/system/process.hpp"
#include "core/system/trace.hpp"
#include "recon/poses/frame_camera.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;

/// Where extraction starts: the device's focal prior at the proxy's size, else COLMAP's own guess
/// of 1.2 times the longer side.
std::string camera_parameters(const Session& session, const ProxyImage& image) {
  const FrameRecord& frame = *image.frame;
  double focal = 1.2 * std::max(image.width, image.height);
  if (frame.width > 0) focal = sfm_prior_camera(session, frame).fx * image.width / frame.width;
  return fmt::format("{},{},{},0", focal, image.width / 2.0, image.height / 2.0);
}

/// A model of proxies renamed and scaled to the recorded frames.
void restore_frames(Reconstruction& model, const std::vector<ProxyImage>& images) {
  std::map<std::string, const ProxyImage*> by_name;
  for (const ProxyImage& image : images) by_name[image.name] = &image;
  std::vector<Eigen::Vector2d> scale(model.views.size(), Eigen::Vector2d::Ones());
  for (std::size_t v = 0; v < model.views.size(); ++v) {
    PosedView& view = model.views[v];
    const auto found = by_name.find(view.name);
    if (found == by_name.end()) continue;
    const FrameRecord& frame = *found->second->frame;
    view.name = frame.file;
    if (frame.width <= 0) continue;
    scale[v] = {static_cast<double>(frame.width) / view.camera.width,
                static_cast<double>(frame.height) / view.camera.height};
    view.camera = view.camera.scaled_to(frame.width, frame.height);
  }
  for (SparsePoint& point : model.points)
    for (Observation& observation : point.track)
      observation.pixel =
          observation.pixel.cwiseProduct(scale[static_cast<std::size_t>(observation.view)]);
}

void append(const SiftFeatures& more, SiftFeatures& features) {
  features.keypoints.insert(features.keypoints.end(), more.keypoints.begin(), more.keypoints.end());
  SiftFeatures::Bytes all(features.descriptors.rows() + more.descriptors.rows(),
                          Eigen::Index{SiftFeatures::Bytes::ColsAtCompileTime});
  all << features.descriptors, more.descriptors;
  features.descriptors = std::move(all);
}

std::string flag(bool on) { return on ? "1" : "0"; }

}  // namespace

std::vector<MapperSettings> mapper_ladder() {
  MapperSettings relaxed;
  relaxed.name = "relaxed settings";
  relaxed.init_min_tri_angle_deg = 6;
  relaxed.init_min_num_inliers = 50;
  relaxed.abs_pose_min_num_inliers = 18;
  relaxed.abs_pose_min_inlier_ratio = 0.15;
  MapperSettings last = relaxed;
  last.name = "most relaxed settings";
  last.init_min_tri_angle_deg = 2;
  last.init_min_num_inliers = 25;
  last.init_max_forward_motion = 1;
  last.abs_pose_min_num_inliers = 12;
  last.abs_pose_min_inlier_ratio = 0.1;
  last.min_num_matches = 10;
  return {MapperSettings{}, relaxed, last};
}

namespace {

/// Adds the end of COLMAP's log to an error: the log itself goes with the stage's folder.
auto with_last_words(const fs::path& folder) {
  return [log = folder / "colmap.log"](Error error) {
    constexpr std::size_t enough = 300;
    const auto text = read_file(log);
    if (!text) return error;
    const std::size_t end = text->find_last_not_of(" \r\n");
    if (end == std::string::npos) return error;
    const std::size_t line = text->find_last_of('\n', end) + 1;
    const std::size_t begin = std::max(line, end + 1 > enough ? end + 1 - enough : 0);
    error.found += "; COLMAP's last words: " + text->substr(begin, end + 1 - begin);
    return error;
  };
}

}  // namespace

Result<ColmapProject> ColmapProject::create(const fs::path& folder, const fs::path& image_folder,
                                            const ColmapOptions& options) {
  std::error_code error;
  fs::remove_all(folder, error);
  fs::create_directories(folder, error);
  if (error)
    return fail(ErrorKind::device, folder.string(), error.message(), "check the disk and rights");
  ColmapProject project;
  project.options_ = options;
  project.folder_ = folder;
  project.image_folder_ = image_folder;
  project.database_ = folder / "database.db";
  return project;
}

Status ColmapProject::run(std::vector<std::string> arguments, const Progress& progress) const {
  arguments.insert(arguments.begin(), options_.command);
  ORBITFUSE_ASSIGN(const int status,
                   run_process(arguments, folder_ / "colmap.log", "poses.colmap", progress)
                       .map_error([](Error error) {
                         if (error.kind == ErrorKind::unavailable)
                           error.remedy =
                               "install it (Debian: apt-get install colmap), put it on PATH or "
                               "name it with --set poses.colmap=FILE";
                         return error;
                       }));
  static_cast<void>(status);  // never believed: callers count what was written
  return {};
}

std::vector<std::string> ColmapProject::seed_and(const std::string& verb) const {
  return {verb, "--random_seed", fmt::format("{}", options_.seed % 2147483647u), "--database_path",
          database_.string()};
}

Status ColmapProject::enter_images(const Session& session, const std::vector<ProxyImage>& images,
                                   const Progress& progress) {
  const fs::path lists = folder_ / "no_features";
  std::error_code error;
  fs::create_directories(lists, error);  // what comes of it, the first file shows
  std::map<std::tuple<std::string, int, int>, std::vector<const ProxyImage*>> groups;
  for (const ProxyImage& image : images) {
    groups[{image.frame->device, image.width, image.height}].push_back(&image);
    ORBITFUSE_TRY(write_file_atomic(lists / (image.name + ".txt"), "0 128\n"));
  }
  int group_number = 0;
  for (const auto& [key, members] : groups) {
    std::string list;
    for (const ProxyImage* image : members) list += image->name + "\n";
    const fs::path list_file = folder_ / fmt::format("images_{}.txt", group_number++);
    ORBITFUSE_TRY(write_file_atomic(list_file, list));
    std::vector<std::string> arguments = seed_and("feature_importer");
    arguments.insert(
        arguments.end(),
        {"--image_path", image_folder_.string(), "--image_list_path", list_file.string(),
         "--import_path", lists.string(), "--ImageReader.camera_model", "SIMPLE_RADIAL",
         "--ImageReader.single_camera", "1", "--ImageReader.camera_params",
         camera_parameters(session, *members.front())});
    ORBITFUSE_TRY(run(std::move(arguments), progress));
  }
  return number_images_by_name(database_).map_error(with_last_words(folder_));
}

Result<std::map<std::string, SiftFeatures>> ColmapProject::find_features(
    const std::vector<ProxyImage>& images, const Progress& progress) const {
  SiftOptions sift;
  sift.max_features = options_.max_features;
  sift.peak_threshold = options_.peak_threshold;
  ORBITFUSE_TRY(sift.validate());
  std::vector<Result<SiftFeatures>> found(images.size());
  parallel_for(static_cast<int>(images.size()), [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    const TraceSpan span("sift", images[at].name);
    if (progress.cancelled()) return;
    found[at] = read_image(image_folder_ / images[at].name).map([&](const cv::Mat& gray) {
      return sift_features(gray, sift);
    });
  });
  ORBITFUSE_TRY(progress.check("poses.features"));
  std::map<std::string, SiftFeatures> features;
  for (std::size_t i = 0; i < images.size(); ++i) {
    ORBITFUSE_ASSIGN(features[images[i].name], std::move(found[i]));
  }
  return features;
}

Result<std::map<std::string, SiftFeatures>> ColmapProject::find_affine_features(
    std::size_t images, const Progress& progress) const {
  const fs::path found = folder_ / "affine.db";
  ORBITFUSE_TRY(
      run({"feature_extractor", "--random_seed", fmt::format("{}", options_.seed % 2147483647u),
           "--database_path", found.string(), "--image_path", image_folder_.string(),
           "--SiftExtraction.num_threads", fmt::format("{}", thread_count()),
           "--SiftExtraction.use_gpu", "0", "--SiftExtraction.estimate_affine_shape", "1",
           "--SiftExtraction.domain_size_pooling", "1", "--SiftExtraction.max_num_features",
           fmt::format("{}", options_.max_features), "--SiftExtraction.peak_threshold",
           fmt::format("{}", options_.peak_threshold)},
          progress));
  ORBITFUSE_ASSIGN(const auto places, read_keypoints(found).map_error(with_last_words(folder_)));
  if (places.size() != images)
    return tl::unexpected(with_last_words(folder_)(
        Error{ErrorKind::input, found.string(),
              fmt::format("COLMAP has described {} of {} images", places.size(), images),
              "see colmap.log beside it"}));
  ORBITFUSE_ASSIGN(const auto descriptors, read_descriptors(found));
  std::map<std::string, SiftFeatures> features;
  for (const auto& [name, pixels] : places) {
    const auto described = descriptors.find(name);
    if (described == descriptors.end() || described->second.rows() != pixels.cols())
      return fail(ErrorKind::input, found.string(), "features that are not described",
                  "run the pose stage again");
    SiftFeatures& image = features[name];
    for (Eigen::Index i = 0; i < pixels.cols(); ++i)
      image.keypoints.push_back(
          {static_cast<float>(pixels(0, i)), static_cast<float>(pixels(1, i)), 1, 0});
    image.descriptors = described->second.cast<std::uint8_t>();
  }
  return features;
}

Result<DatabaseCounts> ColmapProject::extract(const Session& session,
                                              const std::vector<ProxyImage>& images,
                                              const Progress& progress) {
  ORBITFUSE_TRY(enter_images(session, images, progress));
  ORBITFUSE_ASSIGN(auto features, find_features(images, progress));
  if (options_.affine_shapes) {
    ORBITFUSE_ASSIGN(const auto affine, find_affine_features(images.size(), progress));
    for (const auto& [name, more] : affine) append(more, features[name]);
  }
  ORBITFUSE_TRY(write_features(database_, features).map_error(with_last_words(folder_)));
  ORBITFUSE_ASSIGN(const DatabaseCounts counts,
                   count_database(database_).map_error(with_last_words(folder_)));
  if (counts.images_with_features == 0)
    return fail(ErrorKind::quality, "SIFT", fmt::format("no features in {} images", images.size()),
                "check that the images are sharp and show more than one flat surface");
  return counts;
}

Result<DatabaseCounts> ColmapProject::match(const std::vector<ProxyImage>& images,
                                            const std::vector<ViewPair>& pairs,
                                            const Progress& progress) {
  ORBITFUSE_ASSIGN(const auto descriptors, read_descriptors(database_));
  const auto of = [&](int image) -> const Descriptors& {
    static const Descriptors none(0, 128);
    const auto found = descriptors.find(images[static_cast<std::size_t>(image)].name);
    return found == descriptors.end() ? none : found->second;
  };
  std::vector<std::string> blocks(pairs.size());
  parallel_for(static_cast<int>(pairs.size()), [&](int p) {
    if (progress.cancelled()) return;
    const auto [i, j] = pairs[static_cast<std::size_t>(p)];
    std::string& block = blocks[static_cast<std::size_t>(p)];
    block = images[static_cast<std::size_t>(i)].name + " " +
            images[static_cast<std::size_t>(j)].name + "\n";
    for (const auto& [a, b] : match_descriptors(of(i), of(j)))
      block += fmt::format("{} {}\n", a, b);
    block += "\n";
  });
  ORBITFUSE_TRY(progress.check("poses.colmap"));
  const fs::path list_file = folder_ / "matches.txt";
  ORBITFUSE_TRY(write_file_atomic(list_file, fmt::format("{}", fmt::join(blocks, ""))));
  std::vector<std::string> arguments = seed_and("matches_importer");
  arguments.insert(arguments.end(), {"--match_list_path", list_file.string(), "--match_type", "raw",
                                     "--SiftMatching.use_gpu", "0",
                                     // One thread draws the samples of all pairs, in their order.
                                     "--SiftMatching.num_threads", "1"});
  ORBITFUSE_TRY(run(std::move(arguments), progress));
  return count_database(database_);
}

Result<Reconstruction> ColmapProject::map(const Session& session,
                                          const std::vector<ProxyImage>& images,
                                          const MapperSettings& settings,
                                          const Progress& progress) {
  const fs::path sparse = folder_ / "sparse";
  std::error_code error;
  fs::remove_all(sparse, error);
  fs::create_directories(sparse, error);
  // A lens that was calibrated needs no self-calibration, which few views support badly.
  const bool calibrated = std::all_of(images.begin(), images.end(), [&](const ProxyImage& image) {
    const DeviceInfo* device = session.device(image.frame->device);
    return device != nullptr && (device->lens.calibrated || device->lens.focal_relative_sigma == 0);
  });
  std::vector<std::string> arguments = seed_and("mapper");
  const auto add = [&](const char* name, const std::string& value) {
    arguments.push_back(std::string("--Mapper.") + name);
    arguments.push_back(value);
  };
  arguments.insert(arguments.end(),
                   {"--image_path", image_folder_.string(), "--output_path", sparse.string()});
  add("num_threads", "1");  // sums in another order end in another model
  add("ba_refine_focal_length", flag(!calibrated));
  add("init_min_tri_angle", fmt::format("{}", settings.init_min_tri_angle_deg));
  add("init_min_num_inliers", fmt::format("{}", settings.init_min_num_inliers));
  add("init_max_forward_motion", fmt::format("{}", settings.init_max_forward_motion));
  add("abs_pose_min_num_inliers", fmt::format("{}", settings.abs_pose_min_num_inliers));
  add("abs_pose_min_inlier_ratio", fmt::format("{}", settings.abs_pose_min_inlier_ratio));
  // COLMAP's ten would leave no model of nine photos.
  add("min_model_size", fmt::format("{}", std::clamp(static_cast<int>(images.size()) / 2, 3, 10)));
  add("min_num_matches", fmt::format("{}", settings.min_num_matches));
  ORBITFUSE_TRY(run(std::move(arguments), progress));

  Reconstruction best;
  best.modality = images.front().frame->modality;
  for (const auto& entry : fs::directory_iterator(sparse, error)) {
    if (!entry.is_directory()) continue;
    ORBITFUSE_ASSIGN(Reconstruction model, read_colmap_model(entry.path(), best.modality));
    const auto size = std::tuple(model.views.size(), model.points.size());
    if (size > std::tuple(best.views.size(), best.points.size())) best = std::move(model);
  }
  restore_frames(best, images);
  return best;
}

}  // namespace orbitfuse
