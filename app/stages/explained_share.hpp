// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

namespace orbitfuse::stages {

/// How much of what varies in held-out frames their renders have (R squared): of a render that is
/// no nearer to its frame than the frame's own mean, nothing. It needs no unit, and a plain scene
/// is not to blame for being plain.
class ExplainedShare {
 public:
  /// Colours of good fields have .81 to .95 (six scenes), of three and six neighbouring photos less
  /// than nothing.
  static constexpr double least = 0.6;

  /// CV_32F, of one size and number of channels; pixels that are NaN in either are left out.
  void add(const cv::Mat& truth, const cv::Mat& rendered);
  /// NaN where frames hold nothing that varies, or there were none.
  double share() const { return 1 - missed_ / whole_; }
  /// Less than `least`. Not where what is missed is as small as a camera's own noise (RMS).
  bool is_poor(double noise) const;

 private:
  double count_ = 0, whole_ = 0, missed_ = 0;
};

}  // namespace orbitfuse::stages
