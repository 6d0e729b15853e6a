// SPDX-License-Identifier: BSD-3-Clause
#include "bench/poses/spoilt_poses.hpp"

#include <algorithm>
#include <random>
#include <utility>

#include "core/numeric/angle_units.hpp"
#include "core/numeric/median.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse::scenes {
namespace {

using Views = std::vector<PosedView>;

double median_distance(const Views& views) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const PosedView& view : views) middle += camera_center(view.cam_from_world);
  middle /= static_cast<double>(views.size());
  std::vector<double> distances;
  for (const PosedView& view : views)
    distances.push_back((camera_center(view.cam_from_world) - middle).norm());
  return median(std::move(distances));
}

/// In its own axes.
void turn(PosedView& view, const Eigen::Vector3d& axis, double angle_deg) {
  const Rigid3d turned{Eigen::Quaterniond(Eigen::AngleAxisd(angle_deg * radians_per_degree, axis)),
                       Eigen::Vector3d::Zero()};
  view.cam_from_world = turned * view.cam_from_world;
}

void stretch_focal(Views& views, double factor) {
  for (PosedView& view : views) view.camera.fx *= factor, view.camera.fy *= factor;
}

void exchange(Views& views, int a, int b) {
  std::swap(views[static_cast<std::size_t>(a)].cam_from_world,
            views[static_cast<std::size_t>(b)].cam_from_world);
}

void shift_order(Views& views) {
  const Rigid3d first = views.front().cam_from_world;
  for (std::size_t i = 0; i + 1 < views.size(); ++i)
    views[i].cam_from_world = views[i + 1].cam_from_world;
  views.back().cam_from_world = first;
}

/// As poses of a phone's tracking are: a little off each.
void jitter(Views& views, double degrees, double share) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const auto direction = [&]() -> Eigen::Vector3d {
    const double x = normal(random), y = normal(random), z = normal(random);
    return Eigen::Vector3d(x, y, z) / std::sqrt(3.0);
  };
  const double distance = median_distance(views);
  for (PosedView& view : views) {
    const Eigen::Vector3d by = direction() * degrees;
    turn(view, by.normalized(), by.norm());
    view.cam_from_world.translation += direction() * share * distance;
  }
}

/// Into a world turned about the views' mean up, and of another size, about the middle.
void move_all(Views& views, double turn_deg, double scale) {
  const Similarity3d canonical = canonical_from_world(views, {});
  const Similarity3d move{scale,
                          Eigen::Quaterniond(Eigen::AngleAxisd(turn_deg * radians_per_degree,
                                                               Eigen::Vector3d::UnitZ())),
                          Eigen::Vector3d::Zero()};
  const Similarity3d new_from_old = canonical.inverse() * move * canonical;
  for (PosedView& view : views) {
    view.cam_from_world = rebase(view.cam_from_world, new_from_old);
  }
}

/// Two reconstructions in one file: the views from `first` on live in a world of their own.
void move_from(Views& views, std::size_t first, double turn_deg, double scale) {
  Views moved = views;
  move_all(moved, turn_deg, scale);
  std::copy(moved.begin() + static_cast<std::ptrdiff_t>(first), moved.end(),
            views.begin() + static_cast<std::ptrdiff_t>(first));
}

/// The axes of OpenGL's cameras for those of OpenCV's.
void flip_axes(Views& views) {
  for (PosedView& view : views) turn(view, Eigen::Vector3d::UnitX(), 180);
}

}  // namespace

std::vector<SpoiltPoses> spoilt_poses(int count, Modality modality) {
  const int one = count / 3, opposite = (one + count / 4) % count;
  const auto of = [](int view) { return static_cast<std::size_t>(view); };
  std::vector<SpoiltPoses> list;
  const auto add = [&](Fault fault, std::string name, std::function<void(Views&)> spoil) {
    list.push_back({std::move(name), fault, {}, std::move(spoil)});
  };
  const auto all = [&](std::string name, std::function<void(Views&)> spoil) {
    add(Fault::all, std::move(name), std::move(spoil));
  };
  const auto some = [&](std::string name, std::vector<int> views,
                        std::function<void(Views&)> spoil) {
    list.push_back({std::move(name), Fault::views, std::move(views), std::move(spoil)});
  };
  add(Fault::none, "as they are", [](Views&) {});
  // Thermal edges say where a view is to half a degree, matches of photos to a tenth of one; the
  // lines of matches hardly depend on the focal length.
  const bool thermal = modality == Modality::thermal;
  const auto photos_alone = thermal ? Fault::none : Fault::imprecise;
  add(Fault::none, "jitter .1 deg, .1 %", [](Views& v) { jitter(v, 0.1, 0.001); });
  add(photos_alone, "jitter .3 deg, .3 %", [](Views& v) { jitter(v, 0.3, 0.003); });
  add(Fault::imprecise, "jitter 1 deg, 1 %", [](Views& v) { jitter(v, 1, 0.01); });
  add(thermal ? Fault::imprecise : Fault::none, "focal length x 1.02",
      [](Views& v) { stretch_focal(v, 1.02); });
  add(thermal ? Fault::all : Fault::none, "focal length x 1.05",
      [](Views& v) { stretch_focal(v, 1.05); });
  all("focal length x 1.3", [](Views& v) { stretch_focal(v, 1.3); });
  all("focal length x .7", [](Views& v) { stretch_focal(v, 0.7); });
  all("focal length x 10", [](Views& v) { stretch_focal(v, 10); });
  all("shifted by one", shift_order);
  all("order reversed", [](Views& v) {
    Views copy = v;
    for (std::size_t i = 0; i < v.size(); ++i)
      v[i].cam_from_world = copy[v.size() - 1 - i].cam_from_world;
  });
  all("inverted", [](Views& v) {
    for (PosedView& view : v) view.cam_from_world = view.cam_from_world.inverse();
  });
  all("y and z turned", flip_axes);
  if (!thermal) {
    all("one half turned by 20 deg", [=](Views& v) { move_from(v, of(count / 2), 20, 1); });
    all("one half 1.2 times as large", [=](Views& v) { move_from(v, of(count / 2), 0, 1.2); });
    all("a quarter turned by 5 deg", [=](Views& v) { move_from(v, of(count - count / 4), 5, 1); });
  }
  if (thermal) {
    all("world turned by 90 deg", [](Views& v) { move_all(v, 90, 1); });
    all("world turned by 5 deg", [](Views& v) { move_all(v, 5, 1); });
    all("in millimetres", [](Views& v) { move_all(v, 0, 1000); });
    all("world 1.1 times as large", [](Views& v) { move_all(v, 0, 1.1); });
  }
  some("neighbours exchanged", {one, one + 1}, [=](Views& v) { exchange(v, one, one + 1); });
  some("distant ones exchanged", {one, opposite}, [=](Views& v) { exchange(v, one, opposite); });
  some("one rolled by 180 deg", {one},
       [=](Views& v) { turn(v[of(one)], Eigen::Vector3d::UnitZ(), 180); });
  some("one looks away", {one}, [=](Views& v) { turn(v[of(one)], Eigen::Vector3d::UnitY(), 180); });
  some("one turned by 5 deg", {one},
       [=](Views& v) { turn(v[of(one)], Eigen::Vector3d(1, 1, 1).normalized(), 5); });
  some("one 10 % aside", {one}, [=](Views& v) {
    v[of(one)].cam_from_world.translation +=
        0.1 * median_distance(v) * Eigen::Vector3d(0.6, 0.8, 0);
  });
  return list;
}

}  // namespace orbitfuse::scenes
