// SPDX-License-Identifier: BSD-3-Clause
// Width of the edges of real images as they are, and blurred by known amounts:
//   bench_sharpness [SHARED_DATA_FOLDER]
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "capture/guide/coverage.hpp"
#include "capture/image_quality/frame_quality.hpp"
#include "core/image/image_io.hpp"
#include "core/system/clock.hpp"
#include "drivers/stills/thermal_decoder.hpp"
#include "tests/support/shared_data.hpp"

namespace {

namespace fs = std::filesystem;
using namespace orbitfuse;

struct Blur {
  const char* name;
  double gaussian_px;
  int motion_px;
};
constexpr Blur blurs[] = {{"as it is", 0, 0},   {"Gaussian 1", 1, 0}, {"Gaussian 2", 2, 0},
                          {"Gaussian 3", 3, 0}, {"motion 5", 0, 5},   {"motion 9", 0, 9},
                          {"motion 15", 0, 15}};

struct Set {
  const char* name;
  const char* folder;
  Modality modality;
};
constexpr Set sets[] = {{"fox", "orbits/fox/images", Modality::visible},
                        {"flowerpot", "orbits/flowerpot", Modality::visible},
                        {"arco", "orbits/arco/visible", Modality::visible},
                        {"METU sunny", "pairs/metu_sunny_scene_7/visible", Modality::visible},
                        {"METU cloudy", "pairs/metu_cloudy_scene_7/visible", Modality::visible},
                        {"container (rendered)", "orbits/container/visible", Modality::visible},
                        {"arco", "orbits/arco/thermal", Modality::thermal},
                        {"METU sunny", "pairs/metu_sunny_scene_7/thermal", Modality::thermal},
                        {"METU cloudy", "pairs/metu_cloudy_scene_7/thermal", Modality::thermal},
                        {"FLIR radiometric JPEG", "rjpeg", Modality::thermal},
                        {"container (rendered)", "orbits/container/thermal", Modality::thermal}};

std::vector<fs::path> files_of(const fs::path& folder) {
  std::vector<fs::path> files;
  if (!fs::is_directory(folder)) return files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string extension = entry.path().extension();
    if (extension == ".jpg" || extension == ".png" || extension == ".tiff")
      files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// As the recorder would store it: BGR, counts, or counts of temperature of a radiometric JPEG.
cv::Mat frame_of(const fs::path& file, Modality modality) {
  if (modality == Modality::visible) {
    const Result<cv::Mat> image = read_visible(file);
    return image ? *image : cv::Mat();
  }
  const Result<ThermalFile> thermal = read_thermal_file(file);
  if (!thermal) return {};
  if (thermal->kind != ThermalFile::Kind::radiometric_jpeg) return thermal->image;
  const ImportOptions options;
  const auto converted = ThermalDecoder(options).convert(*thermal, file.string());
  return converted ? converted->counts : cv::Mat();
}

/// Blurred at the size at which it is measured, and rounded as a camera would.
cv::Mat blurred(const cv::Mat& frame, const Blur& blur) {
  cv::Mat image = frame;
  const double scale = 640.0 / std::max(frame.cols, frame.rows);
  if (scale < 1) cv::resize(frame, image, {}, scale, scale, cv::INTER_AREA);
  cv::Mat result = image;
  if (blur.gaussian_px > 0) cv::GaussianBlur(image, result, {}, blur.gaussian_px);
  if (blur.motion_px > 0) cv::blur(image, result, {blur.motion_px, 1});
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  const fs::path data = argc > 1 ? fs::path(argv[1]) : testing::shared_data();
  const CoverageOptions floors;
  fmt::print(
      "| images | modality | blur, px | median | least | most | refused "
      "|\n|---|---|---|---|---|---|---|\n");
  double cpu_s = 0;
  int measured = 0;
  for (const Set& set : sets) {
    std::vector<fs::path> files = files_of(data / set.folder);
    for (const Blur& blur : blurs) {
      std::vector<double> sigmas;
      int refused = 0;
      for (const fs::path& file : files) {
        const cv::Mat frame = frame_of(file, set.modality);
        if (frame.empty()) continue;
        const cv::Mat image = blurred(frame, blur);
        const double before_s = cpu_seconds();
        const EdgeBlur edges = measure_edges(image);
        cpu_s += cpu_seconds() - before_s;
        ++measured;
        const double floor = set.modality == Modality::visible ? floors.max_visible_edge_px
                                                               : floors.max_thermal_edge_px;
        refused += edges.edges == 0 || edges.sigma_px > floor;
        sigmas.push_back(edges.sigma_px);
      }
      if (sigmas.empty()) continue;
      std::sort(sigmas.begin(), sigmas.end());
      fmt::print("| {} | {} | {} | {:.2f} | {:.2f} | {:.2f} | {} of {} |\n", set.name,
                 name(set.modality), blur.name, sigmas[sigmas.size() / 2], sigmas.front(),
                 sigmas.back(), refused, sigmas.size());
    }
  }
  if (measured == 0) {
    fmt::print(stderr, "no images under {}; name the folder of the shared data\n", data.string());
    return 2;
  }
  fmt::print("\n{} images measured, {:.1f} ms of CPU time each\n", measured,
             1000 * cpu_s / measured);
}
