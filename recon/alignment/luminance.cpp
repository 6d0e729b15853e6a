// SPDX-License-Identifier: BSD-3-Clause
#include "recon/alignment/luminance.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/image/image_io.hpp"

namespace orbitfuse {

Result<cv::Mat> read_luminance(const Session& session, const FrameRecord& frame) {
  const std::filesystem::path path = session.path_of(frame);
  cv::Mat values;
  if (frame.modality == Modality::thermal && !frame.thermal_is_gray) {
    ORBITFUSE_ASSIGN(values, read_thermal_k(path));
  } else {
    ORBITFUSE_ASSIGN(cv::Mat image,
                     frame.modality == Modality::visible ? read_visible(path) : read_image(path));
    if (image.channels() == 3) cv::cvtColor(image, image, cv::COLOR_BGR2GRAY);
    image.convertTo(values, CV_32F);
  }
  if (frame.width > 0 && (values.cols != frame.width || values.rows != frame.height))
    return fail(ErrorKind::input, path.string(),
                fmt::format("{}x{} px, the manifest says {}x{}", values.cols, values.rows,
                            frame.width, frame.height),
                "import the session again");
  return values;
}

cv::Mat without_glare(const cv::Mat& values) {
  constexpr float ranges = 8;
  std::vector<float> sorted;
  for (const float v : cv::Mat_<float>(values))
    if (std::isfinite(v)) sorted.push_back(v);
  if (sorted.empty()) return values;
  const auto quantile = [&](std::size_t quarter) {
    const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(quarter * (sorted.size() - 1) / 4);
    std::nth_element(sorted.begin(), at, sorted.end());
    return *at;
  };
  const float median = quantile(2), knee = ranges * (quantile(3) - quantile(1));
  const float most = *std::max_element(sorted.begin(), sorted.end()) - median;
  if (!(knee > 0) || !(most > knee)) return values;
  cv::Mat calm = values.clone();
  for (float& v : cv::Mat_<float>(calm))
    if (v - median > knee) v = median + knee * (1 + std::log((v - median) / knee));
  return calm;
}

}  // namespace orbitfuse
