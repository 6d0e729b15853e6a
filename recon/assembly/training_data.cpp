// SPDX-License-Identifier: BSD-3-Clause
#include "recon/assembly/training_data.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/geometry/narrowed.hpp"
#include "core/image/image_io.hpp"
#include "core/image/undistorted.hpp"
#include "core/system/parallel.hpp"
#include "core/system/trace.hpp"

namespace orbitfuse {

Result<cv::Mat> field_image(const std::filesystem::path& file, Samples samples) {
  if (samples == Samples::color) {
    ORBITFUSE_ASSIGN(const cv::Mat bgr, read_visible(file));
    return nerf::rgb_of_bgr8(bgr);
  }
  if (samples == Samples::kelvin) return read_thermal_k(file);
  ORBITFUSE_ASSIGN(cv::Mat levels, read_image(file));
  if (levels.channels() == 3) cv::cvtColor(levels, levels, cv::COLOR_BGR2GRAY);
  levels.convertTo(levels, CV_32F);
  return levels;
}

Result<nerf::Dataset> training_data(const std::filesystem::path& folder,
                                    const Reconstruction& model, Samples samples, int max_width_px,
                                    const Progress& progress) {
  const TraceSpan span("read training images");
  nerf::Dataset data;
  data.modality = model.modality;
  data.thermal_is_gray = samples == Samples::gray;
  data.points = model.points;
  data.views.resize(model.views.size());
  std::vector<Status> problems(model.views.size());
  parallel_for(static_cast<int>(model.views.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    const PosedView& view = model.views[k];
    if (progress.cancelled()) return;
    const auto path = folder / view.name;
    auto image = field_image(path, samples);
    if (!image) {
      problems[k] = tl::unexpected(image.error());
      return;
    }
    problems[k] = check_size(*image, view.camera, path.string());
    if (!problems[k]) return;
    nerf::TrainingView full{view.name, view.camera, view.cam_from_world, *image};
    const Camera narrowed = narrowed_to(view.camera, max_width_px);
    data.views[k] = nerf::resized(full, narrowed.width, narrowed.height);
  });
  ORBITFUSE_TRY(progress.check("train"));
  for (const Status& problem : problems) ORBITFUSE_TRY(problem);
  for (SparsePoint& point : data.points)
    for (Observation& seen : point.track) {
      const auto k = static_cast<std::size_t>(seen.view);
      const Camera &from = model.views[k].camera, &to = data.views[k].camera;
      seen.pixel.x() *= static_cast<double>(to.width) / from.width;
      seen.pixel.y() *= static_cast<double>(to.height) / from.height;
    }
  return data;
}

}  // namespace orbitfuse
