// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "fusion/metrics/planes.hpp"

namespace orbitfuse::metrics {

/// exp(-i^2 / (2 sigma^2)) times `scale`, i = 0..reach: the half of a symmetric kernel.
std::vector<double> gaussian_half(double sigma, int reach, double scale);

/// Both axes filtered by the symmetric kernel whose half is given (centre first); zeros outside.
/// Several times faster in double precision than cv::sepFilter2D. Same bits for any thread count.
Plane blurred(const Plane& f, const std::vector<double>& half);

}  // namespace orbitfuse::metrics
