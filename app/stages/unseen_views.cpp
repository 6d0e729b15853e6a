// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/unseen_views.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace orbitfuse::stages {
namespace {

constexpr double least_surface = 0.01, least_seen = 0.5;

/// "a, b, c and 5 more".
std::string some_of(const std::vector<std::string>& words) {
  constexpr std::size_t most = 6;
  if (words.size() <= most) return fmt::format("{}", fmt::join(words, ", "));
  return fmt::format("{} and {} more", fmt::join(words.begin(), words.begin() + most, ", "),
                     words.size() - most);
}

}  // namespace

void UnseenViews::look_at(const PosedView& view, const cv::Mat& depth) {
  names_.push_back(view.name);
  shares_.push_back(recorded_.share_of(view, depth));
}

void UnseenViews::tell(const std::string& frame, pipeline::StageOutput& output) const {
  std::vector<std::string> empty, unseen;
  double least = 1;
  for (std::size_t i = 0; i < names_.size(); ++i) {
    least = std::min(least, shares_[i].surface * shares_[i].seen);
    if (shares_[i].surface < least_surface)
      empty.push_back(names_[i]);
    else if (shares_[i].seen < least_seen)
      unseen.push_back(fmt::format("{} ({:.0f} %)", names_[i], 100 * shares_[i].seen));
  }
  output.metrics["least_seen"] = least;
  const std::string in_frame =
      !frame.empty() && empty.size() + unseen.size() == names_.size()
          ? fmt::format("; given cameras stand in the world of OUT/{}/transforms.json", frame)
          : "";
  if (!empty.empty())
    output.warnings.push_back(
        fmt::format("new views that show nothing of the scene: {}{}", some_of(empty), in_frame));
  if (!unseen.empty())
    output.warnings.push_back(fmt::format(
        "new views of what no recorded view saw from near there, which the field invents: {} of "
        "their surface was seen{}",
        some_of(unseen), in_frame));
}

}  // namespace orbitfuse::stages
