// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/result.hpp"

namespace orbitfuse {

/// One mistake that all poses of a set would share, and how well they fit without it.
struct Slip {
  std::string words;      ///< "the matrices are inverted (...)"
  double fit = 0;         ///< of the mended poses
  double true_focal = 1;  ///< the likely focal length over the given one
};

/// How well poses fit their images, more is better. Errors are handed on.
using PoseFit = std::function<Result<double>(const std::vector<PosedView>&)>;

/// The likeliest of the usual mistakes in a file of poses: inverted matrices, axes of another
/// convention, poses of the next or the previous image, in reverse order, another focal length.
/// `given`: in the order of capture. None where mended poses fit no better than those given.
Result<std::optional<Slip>> likeliest_slip(const std::vector<PosedView>& given, const PoseFit& fit);

}  // namespace orbitfuse
