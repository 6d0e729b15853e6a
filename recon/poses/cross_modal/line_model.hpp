// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/geometry/camera.hpp"
#include "core/geometry/transform.hpp"
#include "recon/poses/cross_modal/edge_lines.hpp"

namespace orbitfuse {

/// The lines a camera would see: those that some supporting view sees from a similar direction.
class LineModel {
 public:
  LineModel(const std::vector<EdgeLine>& lines, const std::vector<Eigen::Vector3d>& view_centers,
            double max_view_angle_deg = 40);

  struct Sample {
    int line = 0;
    double along = 0;  ///< 0 at the line's a, 1 at b
    Eigen::Vector2d pixel;
    Eigen::Vector2d normal;  ///< unit, image
  };
  /// Points every `step_px` along the visible lines that fall into the image.
  std::vector<Sample> samples(const Camera& camera, const Rigid3d& cam_from_world,
                              double step_px) const;

  const EdgeLine& line(int index) const { return lines_[static_cast<std::size_t>(index)]; }
  std::size_t size() const { return lines_.size(); }

 private:
  std::vector<EdgeLine> lines_;
  std::vector<std::vector<Eigen::Vector3d>> directions_;  ///< per line, towards its views
  double min_cosine_;
};

}  // namespace orbitfuse
