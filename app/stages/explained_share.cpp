// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/explained_share.hpp"

#include <cmath>

namespace orbitfuse::stages {

void ExplainedShare::add(const cv::Mat& truth, const cv::Mat& rendered) {
  const cv::Mat values = truth.reshape(1), error = rendered.reshape(1) - values;
  const cv::Mat valid = error == error;
  const int count = cv::countNonZero(valid);
  if (count == 0) return;
  cv::Scalar mean, deviation;
  cv::meanStdDev(values, mean, deviation, valid);
  count_ += count;
  whole_ += count * deviation[0] * deviation[0];
  missed_ += cv::norm(error, cv::NORM_L2SQR, valid);
}

bool ExplainedShare::is_poor(double noise) const {
  return count_ > 0 && share() < least && std::sqrt(missed_ / count_) > noise;
}

}  // namespace orbitfuse::stages
