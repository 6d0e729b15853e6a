// SPDX-License-Identifier: BSD-3-Clause
#include "recon/alignment/projection.hpp"

#include <ceres/jet.h>
#include <gtest/gtest.h>

namespace orbitfuse {
namespace {

Camera distorted() {
  Camera camera;
  camera.width = 640, camera.height = 480;
  camera.fx = 700, camera.fy = 690, camera.cx = 322, camera.cy = 236;
  camera.k1 = -0.11, camera.k2 = 0.03, camera.p1 = 0.002, camera.p2 = -0.001;
  return camera;
}

TEST(Projection, IsCoresCamera) {
  const Camera camera = distorted();
  const Intrinsics lens = intrinsics_of(camera);
  for (const Eigen::Vector3d& x :
       {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0.3, -0.2, 1.1), Eigen::Vector3d(-2, 1.5, 6)})
    EXPECT_LT((project<double>(x, lens.data()) - camera.project(x)).norm(), 1e-9);
}

TEST(Projection, DerivativesAgreeWithFiniteDifferences) {
  using Jet = ceres::Jet<double, 11>;
  const Intrinsics lens = intrinsics_of(distorted());
  std::array<double, 11> values{0.3, -0.2, 1.1};
  std::copy(lens.begin(), lens.end(), values.begin() + 3);
  std::array<Jet, 11> jets;
  for (int i = 0; i < 11; ++i)
    jets[static_cast<std::size_t>(i)] = Jet(values[static_cast<std::size_t>(i)], i);
  const Eigen::Matrix<Jet, 3, 1> x(jets[0], jets[1], jets[2]);
  const Eigen::Matrix<Jet, 2, 1> pixel = project<Jet>(x, jets.data() + 3);
  const auto at = [](const std::array<double, 11>& v) {
    return project<double>(Eigen::Vector3d(v[0], v[1], v[2]), v.data() + 3);
  };
  for (std::size_t i = 0; i < 11; ++i) {
    const double h = 1e-6 * std::max(1.0, std::abs(values[i]));
    std::array<double, 11> up = values, down = values;
    up[i] += h, down[i] -= h;
    const Eigen::Vector2d numeric = (at(up) - at(down)) / (2 * h);
    for (int k = 0; k < 2; ++k)
      EXPECT_NEAR(pixel[k].v[static_cast<Eigen::Index>(i)], numeric[k],
                  1e-5 * std::max(1.0, std::abs(numeric[k])))
          << "parameter " << i;
  }
}

TEST(Projection, StoreAndLoadAreInverse) {
  const Camera camera = distorted();
  Camera copy;
  copy.width = 640, copy.height = 480;
  store(intrinsics_of(camera), copy);
  EXPECT_EQ(copy, camera);
}

}  // namespace
}  // namespace orbitfuse
