// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "core/geometry/transform.hpp"

namespace orbitfuse {

/// Visual odometry on the scene itself, for when the mat is out of sight: corners of the object and
/// its surroundings are followed from look to look (pyramidal Lucas-Kanade, there and back),
/// triangulated in the mat's frame from views whose pose is known, and the camera is placed against
/// them (P3P in RANSAC, then Levenberg-Marquardt). What lies in the mat's plane is left out, its
/// texture repeats. Points that odometry itself triangulated carry its drift on; they go when the
/// mat is read again.
class SceneOdometry {
 public:
  /// `mat_size_m`: side of the mat, whose own corners are no landmarks.
  explicit SceneOdometry(double mat_size_m) : mat_size_m_(mat_size_m) {}

  /// The mat was read in this image (CV_8UC1; principal point in the middle).
  void remember(const cv::Mat& gray, double focal_px, const Rigid3d& cam_from_mat,
                double sigma_deg);

  struct Sighting {
    Rigid3d cam_from_mat;
    double sigma_deg = 0;  ///< of the last reading, of the fit, and a share of the way since
    double error_px = 0;   ///< of the landmarks, in the image's own pixels
    int landmarks = 0;
  };
  /// Nothing before a reading and when too few landmarks are followed.
  std::optional<Sighting> follow(const cv::Mat& gray, double focal_px);

 private:
  struct Track {
    cv::Point2f first_px, px;
    Rigid3d first_cam_from_mat;
    std::optional<Eigen::Vector3d> point_m;
    double parallax_deg = 0;  ///< that the point was triangulated with
    bool read = true;         ///< only from poses that the mat gave
  };
  struct View {
    cv::Mat gray;  ///< reduced
    double scale = 1, focal_px = 0;
    cv::Point2d centre;
  };
  static View view_of(const cv::Mat& gray, double focal_px);
  std::vector<Track> followed(const View& view) const;
  void settle(const View& view, std::vector<Track> tracks, const Rigid3d& cam_from_mat, bool read);
  bool on_mat(const Eigen::Vector3d& point_m) const;
  void add_tracks(const View& view, const Rigid3d& cam_from_mat, bool read);

  double mat_size_m_;
  View before_;
  std::vector<Track> tracks_;
  std::optional<Rigid3d> pose_;              ///< at before_
  double read_sigma_deg_ = 0, way_deg_ = 0;  ///< way since the last reading
  int misses_ = 0;
};

}  // namespace orbitfuse
