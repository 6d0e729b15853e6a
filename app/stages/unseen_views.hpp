// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "app/pipeline/stage.hpp"
#include "recon/assembly/seen_before.hpp"

namespace orbitfuse::stages {

/// Which new views show what recorded ones saw.
class UnseenViews {
 public:
  explicit UnseenViews(SeenBefore recorded) : recorded_(std::move(recorded)) {}

  /// `depth` as the view's render has it.
  void look_at(const PosedView& view, const cv::Mat& depth);

  /// The least share into the metrics, views that show nothing or mostly what nobody saw by name
  /// into the warnings. `frame`: where the cameras were given in ("poses_visible"); empty: they
  /// were chosen.
  void tell(const std::string& frame, pipeline::StageOutput& output) const;

 private:
  SeenBefore recorded_;
  std::vector<std::string> names_;
  std::vector<SeenOfView> shares_;
};

}  // namespace orbitfuse::stages
