// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/unseen_views.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/first_names.hpp"

namespace orbitfuse::stages {
namespace {

constexpr double least_surface = 0.01, least_seen = 0.5;
constexpr std::size_t most_named = 6;

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
    output.warnings.push_back(fmt::format("new views that show nothing of the scene: {}{}",
                                          first_names(empty, most_named), in_frame));
  if (!unseen.empty())
    output.warnings.push_back(fmt::format(
        "new views of what no recorded view saw from near there, which the field invents: {} of "
        "their surface was seen{}",
        first_names(unseen, most_named), in_frame));
}

}  // namespace orbitfuse::stages
