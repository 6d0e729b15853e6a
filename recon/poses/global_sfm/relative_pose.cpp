// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/global_sfm/relative_pose.hpp"

#include <algorithm>
#include <opencv2/calib3d.hpp>

#include "core/numeric/median.hpp"
#include "recon/poses/index.hpp"

namespace orbitfuse {
namespace {

struct NormalisedMatches {
  std::vector<cv::Point2d> first, second;
  std::vector<FeatureMatch> matches;
};

NormalisedMatches normalised(const FeatureGraph& graph, const std::vector<Camera>& cameras,
                             const ViewPair& pair, const std::vector<FeatureMatch>& matches) {
  const Camera &a = cameras[at(pair.first)], &b = cameras[at(pair.second)];
  NormalisedMatches result;
  for (const FeatureMatch& match : matches) {
    const Eigen::Vector2d p = a.normalized_of(graph.pixels[at(pair.first)].col(match.first)),
                          q = b.normalized_of(graph.pixels[at(pair.second)].col(match.second));
    if (!p.allFinite() || !q.allFinite()) continue;
    result.first.emplace_back(p.x(), p.y());
    result.second.emplace_back(q.x(), q.y());
    result.matches.push_back(match);
  }
  return result;
}

/// Degrees between the rays of matches in one frame's axes, in the median.
double median_parallax_deg(const NormalisedMatches& given, const std::vector<std::uint8_t>& used,
                           const Eigen::Quaterniond& rotation) {
  std::vector<double> angles;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    const Eigen::Vector3d a =
        rotation * Eigen::Vector3d(given.first[i].x, given.first[i].y, 1).normalized();
    const Eigen::Vector3d b = Eigen::Vector3d(given.second[i].x, given.second[i].y, 1).normalized();
    angles.push_back(std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / EIGEN_PI);
  }
  return angles.empty() ? 0 : median(angles);
}

/// The essential matrix that most matches agree with, as a pose in front of which they lie.
std::optional<RelativePose> strongest(const NormalisedMatches& given, const ViewPair& pair,
                                      double threshold, const RelativePoseOptions& options,
                                      std::vector<std::uint8_t>& used) {
  if (static_cast<int>(given.first.size()) < options.min_inliers) return std::nullopt;
  cv::Mat mask;
  const cv::Mat essential = cv::findEssentialMat(given.first, given.second, 1.0, {0, 0}, cv::RANSAC,
                                                 0.999, threshold, 1000, mask);
  if (essential.rows != 3 || essential.cols != 3) return std::nullopt;
  cv::Mat r, t;
  cv::recoverPose(essential, given.first, given.second, r, t, 1.0, {0, 0}, mask);
  used.assign(mask.begin<std::uint8_t>(), mask.end<std::uint8_t>());
  RelativePose pose;
  pose.first = pair.first, pose.second = pair.second;
  Eigen::Matrix3d rotation;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) rotation(i, j) = r.at<double>(i, j);
  pose.second_from_first.rotation = Eigen::Quaterniond(rotation).normalized();
  pose.second_from_first.translation = {t.at<double>(0), t.at<double>(1), t.at<double>(2)};
  for (std::size_t i = 0; i < used.size(); ++i)
    if (used[i]) pose.matches.push_back(given.matches[i]);
  if (static_cast<int>(pose.matches.size()) < options.min_inliers) return std::nullopt;
  return pose;
}

NormalisedMatches without(const NormalisedMatches& given, const std::vector<std::uint8_t>& used) {
  NormalisedMatches rest;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i]) continue;
    rest.first.push_back(given.first[i]);
    rest.second.push_back(given.second[i]);
    rest.matches.push_back(given.matches[i]);
  }
  return rest;
}

}  // namespace

std::vector<RelativePose> relative_poses(const FeatureGraph& graph, const ViewPair& pair,
                                         const RelativePoseOptions& options) {
  const auto proposed = graph.proposed.find(pair);
  if (proposed == graph.proposed.end()) return {};
  return relative_poses(graph, graph.cameras, pair, proposed->second, options);
}

std::vector<RelativePose> relative_poses(const FeatureGraph& graph,
                                         const std::vector<Camera>& cameras, const ViewPair& pair,
                                         const std::vector<FeatureMatch>& matches,
                                         const RelativePoseOptions& options) {
  std::vector<RelativePose> found;
  NormalisedMatches given = normalised(graph, cameras, pair, matches);
  const double threshold = options.max_error_px * graph.pixel_scale / cameras[at(pair.first)].fx;
  std::vector<std::uint8_t> used;
  for (int i = 0; i < options.max_hypotheses; ++i) {
    auto pose = strongest(given, pair, threshold, options, used);
    if (!pose) break;
    if (median_parallax_deg(given, used, pose->second_from_first.rotation) >=
        options.min_parallax_deg)
      found.push_back(std::move(*pose));
    given = without(given, used);
  }
  return found;
}

}  // namespace orbitfuse
