// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <random>

#include "fusion/pyramid/image_pair.hpp"

namespace orbitfuse::fusion {

/// Uniform in [low, high), the same on every library (std's distributions are not).
double uniform(std::mt19937& random, double low, double high);

/// A dead-leaves image (Lee, Mumford, Huang 2001): shapes of scale-free sizes over each other, each
/// with its own shade, gradient and grain. It has the edges, flat parts and texture statistics of
/// photographs without being one.
Plane dead_leaves(cv::Size size, std::uint32_t seed);

}  // namespace orbitfuse::fusion
