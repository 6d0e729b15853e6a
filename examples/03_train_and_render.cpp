// SPDX-License-Identifier: BSD-3-Clause
// 03_train_and_render transforms.json steps view.png: a radiance field of posed photos
// (nerfstudio's format), rendered from the first photo's place.
#include <charconv>
#include <cstring>
#include <iostream>
#include <opencv2/imgproc.hpp>
#include <orbitfuse/core/formats/transforms_json.hpp>
#include <orbitfuse/core/image/image_io.hpp>
#include <orbitfuse/recon/nerf/nerf.hpp>

namespace of = orbitfuse;

of::Status train_and_render(const std::filesystem::path& file, int steps, const char* view_file) {
  ORBITFUSE_ASSIGN(const of::Transforms photos, of::read_transforms_json(file));
  of::nerf::Dataset dataset;
  for (const of::TransformsFrame& photo : photos.frames) {
    ORBITFUSE_ASSIGN(const cv::Mat bgr, of::read_visible(file.parent_path() / photo.file_path));
    dataset.views.push_back(
        {photo.file_path, photo.camera, photo.cam_from_world, of::nerf::rgb_of_bgr8(bgr)});
  }
  ORBITFUSE_ASSIGN(of::nerf::TrainOptions options, of::nerf::preset("fast-visible"));
  options.iterations = steps;  // a full run has 4000
  options.holdout_every = 8;   // every 8th photo measures and never trains
  of::nerf::Field field;
  ORBITFUSE_ASSIGN(const auto report, of::nerf::train(dataset, options, {}, field));
  std::cout << report.brief() << "\n";
  ORBITFUSE_ASSIGN(const auto view, of::nerf::render(field, dataset.views[0].camera,
                                                     dataset.views[0].cam_from_world, {}, {}));
  cv::Mat rgb8, bgr8;
  view.color.convertTo(rgb8, CV_8U, 255);
  cv::cvtColor(rgb8, bgr8, cv::COLOR_RGB2BGR);
  return of::write_png(view_file, bgr8);
}

int main(int argc, char** argv) {
  int steps = 0;
  const auto is_number = [&](const char* text) {
    const char* end = text + std::strlen(text);
    return std::from_chars(text, end, steps) == std::from_chars_result{end, std::errc{}};
  };
  if (argc != 4 || !is_number(argv[2])) {
    std::cerr << "usage: 03_train_and_render transforms.json steps view.png\n";
    return 2;
  }
  const of::Status done = train_and_render(argv[1], steps, argv[3]);
  if (!done) std::cerr << done.error().message() << "\n";
  return done ? 0 : 1;
}
