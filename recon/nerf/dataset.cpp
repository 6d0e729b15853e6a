// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/dataset.hpp"

#include <fmt/format.h>
#include <limits>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace orbitfuse::nerf {
namespace {

Status check_view(const TrainingView& view, Modality modality) {
  const auto bad = [&](std::string found, std::string remedy) {
    return fail(ErrorKind::input, view.name, std::move(found), std::move(remedy));
  };
  const int type = modality == Modality::visible ? CV_32FC3 : CV_32FC1;
  if (view.image.empty()) return bad("no image", "remove the view or read its file");
  if (view.image.type() != type)
    return bad("wrong pixel type", modality == Modality::visible ? "pass CV_32FC3 R, G, B in 0..1"
                                                                 : "pass CV_32FC1 kelvin");
  if (view.image.cols != view.camera.width || view.image.rows != view.camera.height)
    return bad(fmt::format("image {}x{}, camera {}x{}", view.image.cols, view.image.rows,
                           view.camera.width, view.camera.height),
               "scale the camera with the image");
  ORBITFUSE_TRY(view.camera.validate(view.name));
  if (!view.cam_from_world.is_finite()) return bad("pose is not finite", "drop the view");
  if (modality == Modality::visible && !cv::checkRange(view.image, true, nullptr, -0.5, 1.5))
    return bad("a sample is not finite or outside 0..1", "drop or repair the frame");
  if (modality == Modality::thermal) {
    for (int y = 0; y < view.image.rows; ++y)
      for (const float *p = view.image.ptr<float>(y), *e = p + view.image.cols; p != e; ++p)
        if (std::isinf(*p)) return bad("a temperature is infinite", "mark bad pixels as NaN");
  }
  return {};
}

}  // namespace

Status Dataset::validate() const {
  if (views.empty())
    return fail(ErrorKind::input, std::string(name(modality)), "no views to train on",
                "pose at least two views");
  for (const TrainingView& view : views) ORBITFUSE_TRY(check_view(view, modality));
  const int count = static_cast<int>(views.size());
  for (const SparsePoint& point : points) {
    if (!point.position.allFinite())
      return fail(ErrorKind::input, "sparse points", "a point is not finite", "drop it");
    for (const Observation& o : point.track)
      if (o.view < 0 || o.view >= count)
        return fail(ErrorKind::input, "sparse points", fmt::format("track names view {}", o.view),
                    fmt::format("views are 0..{}", count - 1));
  }
  for (const DepthMap& map : depth)
    if (map.view < 0 || map.view >= count || map.depth.type() != CV_32FC1)
      return fail(ErrorKind::input, "depth maps",
                  fmt::format("map of view {} is malformed", map.view),
                  "pass CV_32FC1 depth of a training view");
  return {};
}

double Dataset::known_depth() const {
  std::int64_t known = 0, all = 0;
  for (const DepthMap& map : depth) {
    known += cv::countNonZero(cv::abs(map.depth) < std::numeric_limits<float>::infinity());
    all += static_cast<std::int64_t>(map.depth.total());
  }
  return all > 0 ? static_cast<double>(known) / static_cast<double>(all) : 0;
}

cv::Mat rgb_of_bgr8(const cv::Mat& bgr8, cv::Size size) {
  cv::Mat small = bgr8, rgb, out;
  if (size.area() > 0 && size != bgr8.size()) cv::resize(bgr8, small, size, 0, 0, cv::INTER_AREA);
  cv::cvtColor(small, rgb, cv::COLOR_BGR2RGB);
  rgb.convertTo(out, CV_32FC3, 1.0 / 255);
  return out;
}

double shading_r2(double x, double y, cv::Size size) {
  const double dx = x - 0.5 * size.width, dy = y - 0.5 * size.height;
  return (dx * dx + dy * dy) / (0.25 * size.width * size.width);
}

cv::Mat shading_image(double falloff_k, cv::Size size) {
  cv::Mat image(size, CV_32FC1);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      image.at<float>(y, x) = static_cast<float>(falloff_k * shading_r2(x + 0.5, y + 0.5, size));
  return image;
}

TrainingView resized(const TrainingView& view, int width, int height) {
  TrainingView out = view;
  if (width == view.image.cols && height == view.image.rows) return out;
  out.camera = view.camera.scaled_to(width, height);
  cv::resize(view.image, out.image, {width, height}, 0, 0, cv::INTER_AREA);
  return out;
}

}  // namespace orbitfuse::nerf
