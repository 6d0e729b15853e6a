// SPDX-License-Identifier: BSD-3-Clause
// The printed mat as an image for render_mat.py, its top row the page's:
//   mat_image OUT.png --size 2.4 [--tags 9] [--px 4096]
#include <CLI/CLI.hpp>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "bench/exit_status.hpp"
#include "capture/mat/mat_design.hpp"
#include "core/image/image_io.hpp"

namespace orbitfuse {
namespace {

struct Options {
  std::string out;
  MatDesign design;
  int side_px = 4096;
};

Status run(const Options& o) {
  ORBITFUSE_TRY(o.design.validate());
  cv::Mat image(o.side_px, o.side_px, CV_8UC3, cv::Scalar::all(255));
  const double px_per_m = o.side_px / o.design.size_m;
  const auto column = [&](double x) {
    return static_cast<int>(std::lround((x + o.design.size_m / 2) * px_per_m));
  };
  const auto row = [&](double y) {
    return static_cast<int>(std::lround((o.design.size_m / 2 - y) * px_per_m));
  };
  for (const MatRectangle& r : black_rectangles(o.design))
    cv::rectangle(image, cv::Point(column(r.left), row(r.bottom + r.height)),
                  cv::Point(column(r.left + r.width) - 1, row(r.bottom) - 1), cv::Scalar::all(0),
                  cv::FILLED);
  return write_png(o.out, image);
}

}  // namespace
}  // namespace orbitfuse

int main(int argc, char** argv) {
  CLI::App app("The printed mat as an image");
  orbitfuse::Options options;
  app.add_option("out", options.out, "PNG")->required();
  app.add_option("--size", options.design.size_m, "Side, m")->capture_default_str();
  app.add_option("--tags", options.design.tags_per_side, "Tags a side")->capture_default_str();
  app.add_option("--px", options.side_px, "Pixels a side")
      ->check(CLI::Range(64, 16384))
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return orbitfuse::exit_status(orbitfuse::run(options));
}
