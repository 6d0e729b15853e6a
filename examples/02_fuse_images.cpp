// SPDX-License-Identifier: BSD-3-Clause
// 02_fuse_images visible.jpg thermal.png fused.png: one image of an aligned pair, and its quality.
#include <iostream>
#include <orbitfuse/core/image/image_io.hpp>
#include <orbitfuse/fusion/fuse/fuse.hpp>
#include <orbitfuse/fusion/metrics/metrics.hpp>

namespace of = orbitfuse;

// Every call answers with a value or an error that says where, what and what to do.
of::Status fuse_files(const char* visible_file, const char* thermal_file, const char* fused_file) {
  ORBITFUSE_ASSIGN(const cv::Mat visible, of::read_image(visible_file));
  ORBITFUSE_ASSIGN(const cv::Mat thermal, of::read_image(thermal_file));
  of::FusionOptions options;
  options.method = of::FusionMethod::best;
  const cv::Mat valid_everywhere;
  ORBITFUSE_ASSIGN(const cv::Mat fused, of::fuse(visible, thermal, valid_everywhere, options));
  ORBITFUSE_TRY(of::write_png(fused_file, fused));
  ORBITFUSE_ASSIGN(const auto metrics, of::fusion_metrics(visible, thermal, fused));
  for (const of::MetricValue& metric : metrics) {
    std::cout << metric.name << " " << metric.value << "\n";
  }
  return {};
}

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "usage: 02_fuse_images visible thermal fused.png\n";
    return 2;
  }
  const of::Status done = fuse_files(argv[1], argv[2], argv[3]);
  if (!done) std::cerr << done.error().message() << "\n";
  return done ? 0 : 1;
}
