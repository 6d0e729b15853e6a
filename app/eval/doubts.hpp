// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/geometry/pose_error.hpp"

// A truth of another scene, or of this one in another order, gives figures too.
namespace orbitfuse::eval {

/// Why `error`, that of `pairs` in the order of capture, may say nothing of the poses: it is larger
/// than a run passes without a warning of its own. Of up to 150 pairs it says so where another
/// order would fit.
std::optional<std::string> doubt_of_truth(const std::vector<PosePair>& pairs,
                                          const PoseError& error);

/// The like of test views that are much worse than the views which the run itself held out: of
/// evenly spaced stations, every order fits turned poses. NaN: there were none.
std::optional<std::string> doubt_of_test_views(double test_psnr_db, double heldout_psnr_db);

}  // namespace orbitfuse::eval
