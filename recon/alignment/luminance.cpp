// SPDX-License-Identifier: BSD-3-Clause
#include "recon/alignment/luminance.hpp"

#include <fmt/format.h>

#include <opencv2/imgproc.hpp>

#include "core/image/image_io.hpp"

namespace orbitfuse {

Result<cv::Mat> read_luminance(const Session& session, const FrameRecord& frame) {
  const std::filesystem::path path = session.path_of(frame);
  cv::Mat values;
  if (frame.modality == Modality::thermal && !frame.thermal_is_gray) {
    ORBITFUSE_ASSIGN(values, read_thermal_k(path));
  } else {
    ORBITFUSE_ASSIGN(cv::Mat image, read_image(path));
    if (frame.modality == Modality::visible) {
      ORBITFUSE_ASSIGN(image, read_visible(path));
    }
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

}  // namespace orbitfuse
