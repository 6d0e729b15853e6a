// SPDX-License-Identifier: BSD-3-Clause
#include "capture/mat/mat_tracker.hpp"

#include <opencv2/video/tracking.hpp>

namespace orbitfuse {
namespace {

constexpr int most_steps = 8;  // two seconds at the guide's four looks
constexpr std::size_t fewest_corners = 16;
constexpr float most_tag_disagreement_px = 1.0f;

}  // namespace

void MatTracker::remember(const cv::Mat& gray, const MatCorners& corners) {
  before_ = gray.clone();
  corners_ = corners;
  steps_ = 0;
}

std::optional<MatCorners> MatTracker::follow(const cv::Mat& gray) {
  if (before_.size() != gray.size() || corners_.image.empty() || ++steps_ > most_steps) {
    before_.release();
    return std::nullopt;
  }
  std::vector<cv::Point2f> start(corners_.image.begin(), corners_.image.end()), end, back;
  std::vector<unsigned char> forth_good, back_good;
  cv::calcOpticalFlowPyrLK(before_, gray, start, end, forth_good, cv::noArray(), {21, 21}, 4);
  cv::calcOpticalFlowPyrLK(gray, before_, end, back, back_good, cv::noArray(), {21, 21}, 4);
  MatCorners kept;
  for (std::size_t tag = 0; tag + 3 < start.size(); tag += 4) {
    bool good = true;
    for (std::size_t i = tag; i < tag + 4; ++i) {
      const cv::Point2f off = back[i] - start[i];
      good = good && forth_good[i] && back_good[i] &&
             off.dot(off) <= most_tag_disagreement_px * most_tag_disagreement_px;
    }
    if (!good) continue;
    for (std::size_t i = tag; i < tag + 4; ++i) {
      kept.mat.push_back(corners_.mat[i]);
      kept.image.push_back(end[i]);
    }
  }
  if (kept.image.size() < fewest_corners) {
    before_.release();
    return std::nullopt;
  }
  before_ = gray.clone();
  corners_ = kept;
  return kept;
}

}  // namespace orbitfuse
