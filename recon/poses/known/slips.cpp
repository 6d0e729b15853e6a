// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/known/slips.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace orbitfuse {
namespace {

using Views = std::vector<PosedView>;

/// With each pose replaced by what `mended` makes of it.
template <class Function>
Views each(Views views, const Function& mended) {
  for (PosedView& view : views) view.cam_from_world = mended(view.cam_from_world);
  return views;
}

/// The poses given to other images: the one at `from(i, count)` to the i-th.
template <class Function>
Views reordered(const Views& views, const Function& from) {
  Views result = views;
  for (std::size_t i = 0; i < views.size(); ++i)
    result[i].cam_from_world = views[from(i, views.size())].cam_from_world;
  return result;
}

Views with_focal(Views views, double factor) {
  for (PosedView& view : views) view.camera.fx *= factor, view.camera.fy *= factor;
  return views;
}

/// The focal length that fits best, as a factor of the given one: where several fit equally well,
/// the one in their middle.
Result<Slip> other_focal(const Views& given, double given_fit, const PoseFit& fit) {
  constexpr double widest = 16, step = 1.12, finest = 1.004;
  double best = given_fit, low = 1, high = 1;
  const auto look = [&](double factor) -> Status {
    ORBITFUSE_ASSIGN(const double found, fit(with_focal(given, factor)));
    if (found > best) best = found, low = high = factor;
    if (found == best) low = std::min(low, factor), high = std::max(high, factor);
    return {};
  };
  for (double factor = 1 / widest; factor <= widest; factor *= step) ORBITFUSE_TRY(look(factor));
  for (double ratio = std::sqrt(step); ratio > finest; ratio = std::sqrt(ratio)) {
    const double lowest = low, highest = high;
    ORBITFUSE_TRY(look(highest * ratio));
    ORBITFUSE_TRY(look(lowest / ratio));
  }
  const double factor = std::sqrt(low * high);
  return Slip{fmt::format("the focal length is {:.3g} times what it should be", 1 / factor), best,
              factor};
}

}  // namespace

Result<std::optional<Slip>> likeliest_slip(const std::vector<PosedView>& given,
                                           const PoseFit& fit) {
  const Rigid3d axes_turned{Eigen::Quaterniond(0, 1, 0, 0), Eigen::Vector3d::Zero()};
  const char* inverted = "the matrices are inverted (world to camera for camera to world, or back)";
  const std::vector<std::pair<const char*, Views>> mended = {
      // By way of a file in OpenGL's axes the reader has turned them once, or mistakenly.
      {inverted, each(given, [](const Rigid3d& pose) { return pose.inverse(); })},
      {inverted, each(given, [&](const Rigid3d& pose) { return (axes_turned * pose).inverse(); })},
      {inverted,
       each(given,
            [&](const Rigid3d& pose) { return axes_turned * (axes_turned * pose).inverse(); })},
      {"the cameras' y and z axes are turned (OpenGL's for OpenCV's, or back)",
       each(given, [&](const Rigid3d& pose) { return axes_turned * pose; })},
      {"each pose is the next image's",
       reordered(given, [](std::size_t i, std::size_t n) { return (i + n - 1) % n; })},
      {"each pose is the previous image's",
       reordered(given, [](std::size_t i, std::size_t n) { return (i + 1) % n; })},
      {"the poses are in reverse order",
       reordered(given, [](std::size_t i, std::size_t n) { return n - 1 - i; })}};
  ORBITFUSE_ASSIGN(const double given_fit, fit(given));
  ORBITFUSE_ASSIGN(Slip best, other_focal(given, given_fit, fit));
  for (const auto& [words, views] : mended) {
    ORBITFUSE_ASSIGN(const double found, fit(views));
    if (found > best.fit) best = {words, found, 1};
  }
  if (!(best.fit > given_fit)) return std::optional<Slip>();
  return std::optional<Slip>(std::move(best));
}

}  // namespace orbitfuse
