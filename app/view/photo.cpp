// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/photo.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "app/view/picture_parts.hpp"
#include "core/image/image_io.hpp"
#include "core/image/undistorted.hpp"

namespace orbitfuse::view {
namespace {

constexpr int widest_px = 1280;

cv::Mat without_distortion(const cv::Mat& image, const Camera& from) {
  const Camera to = from.without_distortion();
  if (!from.has_distortion() || image.cols != from.width || image.rows != from.height) return image;
  std::vector<cv::Mat> channels;
  cv::split(image, channels);
  for (cv::Mat& channel : channels) channel = undistorted(channel, from, to);
  cv::Mat straight;
  cv::merge(channels, straight);
  return straight;
}

cv::Mat fitted(const cv::Mat& image, int how) {
  if (image.cols <= widest_px) return image;
  cv::Mat small;
  cv::resize(image, small, {widest_px, std::max(1, image.rows * widest_px / image.cols)}, 0, 0,
             how);
  return small;
}

}  // namespace

Result<std::string> photo(const FinishedRun& run, std::size_t index) {
  if (index >= run.views.size())
    return fail(ErrorKind::input, fmt::format("photo {}", index), "no such view",
                fmt::format("there are {}", run.views.size()));
  const RecordedView& recorded = run.views[index];
  if (!run.session)
    return fail(ErrorKind::input, recorded.view.name, "the session is not where the run read it",
                "bring it back, and open the viewer again");
  const auto& frames = run.session->frames;
  // A model's names are only names: what is read is what the session lists.
  if (std::none_of(frames.begin(), frames.end(),
                   [&](const FrameRecord& f) { return f.file == recorded.view.name; }))
    return fail(ErrorKind::input, recorded.view.name, "the session lists no such frame",
                "run the session again");
  const auto file = run.session->folder / recorded.view.name;
  PictureParts parts;
  const Camera& camera = recorded.view.camera;
  if (recorded.modality == Modality::visible) {
    ORBITFUSE_ASSIGN(const cv::Mat bgr, read_visible(file));  // upright, as its pose is
    ORBITFUSE_TRY(
        parts.add_jpeg("visible", fitted(without_distortion(bgr, camera), cv::INTER_AREA), 88));
  } else if (run.thermal_is_gray) {
    ORBITFUSE_ASSIGN(const cv::Mat image, read_image(file));
    cv::Mat gray = fitted(without_distortion(image, camera), cv::INTER_AREA), levels;
    if (gray.channels() == 3) cv::cvtColor(gray, gray, cv::COLOR_BGR2GRAY);
    gray.convertTo(levels, CV_32F);
    parts.add_levels("thermal", levels, true);
  } else {
    ORBITFUSE_ASSIGN(const cv::Mat kelvin, read_thermal_k(file));
    parts.add_levels("thermal", fitted(without_distortion(kelvin, camera), cv::INTER_NEAREST),
                     false);
  }
  return parts.bytes();
}

}  // namespace orbitfuse::view
