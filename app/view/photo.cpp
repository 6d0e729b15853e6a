// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/photo.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "app/view/picture_parts.hpp"
#include "core/image/image_io.hpp"
#include "core/image/samples.hpp"
#include "core/image/undistorted.hpp"

namespace orbitfuse::view {
namespace {

constexpr int widest_px = 1280;

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
  const auto straight = [&](const cv::Mat& image) {
    return recorded_straight(image, recorded.view.camera, recorded.view.name);
  };
  if (recorded.modality == Modality::visible) {
    ORBITFUSE_ASSIGN(const cv::Mat recorded_bgr, read_visible(file));  // upright, as its pose is
    ORBITFUSE_ASSIGN(const cv::Mat bgr, straight(recorded_bgr));
    ORBITFUSE_TRY(parts.add_jpeg("visible", no_wider(bgr, widest_px, cv::INTER_AREA), 88));
  } else if (run.thermal_is_gray) {
    ORBITFUSE_ASSIGN(const cv::Mat recorded_image, read_image(file));
    ORBITFUSE_ASSIGN(const cv::Mat image, straight(recorded_image));
    cv::Mat gray = no_wider(image, widest_px, cv::INTER_AREA), levels;
    if (gray.channels() == 3) cv::cvtColor(gray, gray, cv::COLOR_BGR2GRAY);
    gray.convertTo(levels, CV_32F);
    if (const auto curve = run.gray_curves.find(recorded.view.name); curve != run.gray_curves.end())
      levels = nerf::to_common_levels(levels, curve->second);  // as the field has them
    parts.add_levels("thermal", levels, true);
  } else {
    ORBITFUSE_ASSIGN(cv::Mat recorded_k, read_thermal_k(file));
    recorded_k -= nerf::shading_image(run.shading_k, recorded_k.size());  // as measurements do
    ORBITFUSE_ASSIGN(const cv::Mat kelvin, straight(recorded_k));
    parts.add_levels("thermal", no_wider(kelvin, widest_px, cv::INTER_NEAREST), false);
  }
  return parts.bytes();
}

}  // namespace orbitfuse::view
