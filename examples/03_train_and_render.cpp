// SPDX-License-Identifier: BSD-3-Clause
// 03_train_and_render JSON STEPS PNG: a radiance field of posed photos
// (nerfstudio's transforms.json), rendered from the first photo's place.
#include <cstdlib>
#include <iostream>
#include <opencv2/imgproc.hpp>
#include <orbitfuse/core/formats/transforms_json.hpp>
#include <orbitfuse/core/image/image_io.hpp>
#include <orbitfuse/recon/nerf/nerf.hpp>
namespace of = orbitfuse;

of::Status train_and_render(const std::filesystem::path& file, int steps, const char* view_file) {
  ORBITFUSE_ASSIGN(const of::Transforms photos, of::read_transforms_json(file));
  of::nerf::Dataset dataset;
  for (const of::TransformsFrame& frame : photos.frames) {
    ORBITFUSE_ASSIGN(const cv::Mat photo, of::read_visible(file.parent_path() / frame.file_path));
    const cv::Mat rgb = of::nerf::rgb_of_bgr8(photo);
    dataset.views.push_back({frame.file_path, frame.camera, frame.cam_from_world, rgb});
  }
  ORBITFUSE_ASSIGN(of::nerf::TrainOptions options, of::nerf::preset("fast-visible"));
  options.iterations = steps, options.holdout_every = 8;  // these photos measure, never train
  of::nerf::Field field;
  ORBITFUSE_ASSIGN(const auto report, of::nerf::train(dataset, options, {}, field));
  std::cout << report.brief() << "\n";
  ORBITFUSE_ASSIGN(const auto view, of::nerf::render(field, dataset.views[0].camera,
                                                     dataset.views[0].cam_from_world, {}, {}));
  cv::Mat bgr;
  cv::cvtColor(view.color, bgr, cv::COLOR_RGB2BGR);
  bgr.convertTo(bgr, CV_8U, 255);
  return of::write_png(view_file, bgr);
}

int main(int argc, char** argv) {
  const int steps = argc == 4 ? std::atoi(argv[2]) : 0;
  if (steps < 1) return std::cerr << "usage: 03_train_and_render JSON STEPS PNG\n", 2;
  const of::Status done = train_and_render(argv[1], steps, argv[3]);
  if (!done) std::cerr << done.error().message() << "\n";
  return done ? 0 : 1;
}
