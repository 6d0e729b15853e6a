// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/feature_graph.hpp"

#include <algorithm>

#include "recon/poses/frame_camera.hpp"
#include "recon/poses/sfm/colmap_database.hpp"

namespace orbitfuse {
namespace {

PairMatches by_frame(const NamedMatches& named, const std::map<std::string, int>& frame_of) {
  PairMatches pairs;
  for (const auto& [names, matches] : named) {
    const auto a = frame_of.find(names.first), b = frame_of.find(names.second);
    if (a == frame_of.end() || b == frame_of.end() || a->second >= b->second) continue;
    pairs[{a->second, b->second}] = matches;
  }
  return pairs;
}

}  // namespace

Eigen::Matrix3Xd FeatureGraph::rays(int frame, const Camera& camera) const {
  const Eigen::Matrix2Xd& of = pixels[static_cast<std::size_t>(frame)];
  Eigen::Matrix3Xd result(3, of.cols());
  for (Eigen::Index i = 0; i < of.cols(); ++i) result.col(i) = camera.ray_of(of.col(i));
  return result;
}

Result<FeatureGraph> read_feature_graph(const std::filesystem::path& database,
                                        const Session& session,
                                        const std::vector<ProxyImage>& images) {
  ORBITFUSE_ASSIGN(auto keypoints, read_keypoints(database));
  ORBITFUSE_ASSIGN(auto descriptors, read_descriptors(database));
  ORBITFUSE_ASSIGN(const NamedMatches proposed, read_matches(database, MatchKind::proposed));
  ORBITFUSE_ASSIGN(const NamedMatches verified, read_matches(database, MatchKind::verified));
  FeatureGraph graph;
  std::map<std::string, int> frame_of;
  for (const ProxyImage& image : images) {
    frame_of[image.name] = graph.count();
    FrameRecord sized = *image.frame;
    // A frame that doesn't state its size is as large as its proxy.
    if (sized.width <= 0) sized.width = image.width, sized.height = image.height;
    const Eigen::Vector2d scale(static_cast<double>(sized.width) / image.width,
                                static_cast<double>(sized.height) / image.height);
    graph.pixel_scale = std::max(graph.pixel_scale, scale.x());
    graph.frames.push_back(image.frame);
    graph.cameras.push_back(sfm_prior_camera(session, sized));
    graph.pixels.emplace_back(scale.asDiagonal() * keypoints[image.name]);
    graph.descriptors.push_back(std::move(descriptors[image.name]));
  }
  graph.proposed = by_frame(proposed, frame_of);
  graph.verified = by_frame(verified, frame_of);
  return graph;
}

}  // namespace orbitfuse
