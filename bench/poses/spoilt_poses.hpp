// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/modality.hpp"

namespace orbitfuse::scenes {

/// What must be said of poses: nothing, that they are imprecise, which views are wrong, or that all
/// are.
enum class Fault { none, imprecise, views, all };

/// A way in which poses that a user gives are wrong, or nearly right.
struct SpoiltPoses {
  std::string name;
  Fault fault = Fault::none;
  std::vector<int> views;  ///< the wrong ones by index
  std::function<void(std::vector<PosedView>&)> spoil;
};

/// For `count` views in the order of capture. Photos can't tell the world that all of them live in:
/// that is spoilt for thermal views alone, which share the visible ones'.
std::vector<SpoiltPoses> spoilt_poses(int count, Modality modality);

}  // namespace orbitfuse::scenes
