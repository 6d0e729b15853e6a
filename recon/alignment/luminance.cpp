// SPDX-License-Identifier: BSD-3-Clause
#include "recon/alignment/luminance.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/image/image_io.hpp"
#include "core/image/samples.hpp"
#include "core/numeric/median.hpp"

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
  std::vector<float> samples;
  append_finite(values, samples);
  if (samples.empty()) return values;
  const float middle = quantile(samples, 0.5),
              knee = ranges * (quantile(samples, 0.75) - quantile(samples, 0.25));
  const float most = *std::max_element(samples.begin(), samples.end()) - middle;
  if (!(knee > 0) || !(most > knee)) return values;
  cv::Mat calm = values.clone();
  for (float& v : cv::Mat_<float>(calm))
    if (v - middle > knee) v = middle + knee * (1 + std::log((v - middle) / knee));
  return calm;
}

}  // namespace orbitfuse
