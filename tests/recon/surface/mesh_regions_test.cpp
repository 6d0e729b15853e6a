// SPDX-License-Identifier: BSD-3-Clause
#include "recon/surface/mesh_regions.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace orbitfuse {
namespace {

/// A strip of squares of side 1 along x, two triangles each.
TriangleMesh strip(std::uint32_t squares) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i <= squares; ++i)
    for (const double y : {0.0, 1.0}) mesh.vertices.positions.emplace_back(i, y, 0);
  for (std::uint32_t i = 0; i < squares; ++i) {
    mesh.triangles.push_back({2 * i, 2 * i + 2, 2 * i + 1});
    mesh.triangles.push_back({2 * i + 1, 2 * i + 2, 2 * i + 3});
  }
  return mesh;
}

TEST(MeshRegions, AreasAddUpToTheMesh) {
  const TriangleMesh mesh = strip(5);
  double sum = 0;
  for (const double area : vertex_areas(mesh)) sum += area;
  EXPECT_NEAR(sum, 5, 1e-12);
}

TEST(MeshRegions, LabelsThatTouchAreOneRegionTheLargestFirst) {
  const TriangleMesh mesh = strip(9);
  std::vector<int> labels(mesh.vertices.size(), 0);
  for (const std::size_t v : {0, 1, 2, 3}) labels[v] = 1;
  for (const std::size_t v : {8, 9, 10, 11, 12, 13}) labels[v] = 1;
  labels[18] = labels[19] = -1;
  const auto regions = connected_regions(mesh, labels);
  ASSERT_EQ(regions.size(), 3U);
  EXPECT_EQ(regions[0].vertices.size(), 6U);
  EXPECT_NEAR(regions[0].center.x(), 5, 0.1);
  EXPECT_EQ(regions[1].vertices.size(), 4U);
  EXPECT_EQ(regions[2].label, -1);
}

TEST(MeshRegions, NothingLabelledOrNothingThereIsNoRegion) {
  const TriangleMesh mesh = strip(2);
  EXPECT_TRUE(connected_regions(mesh, std::vector<int>(mesh.vertices.size(), 0)).empty());
  EXPECT_TRUE(connected_regions({}, {}).empty());
}

TEST(MeshRegions, CornersThatAreNoNumberHaveNoArea) {
  TriangleMesh mesh = strip(2);
  mesh.vertices.positions[0].x() = std::numeric_limits<double>::quiet_NaN();
  for (const double area : vertex_areas(mesh)) EXPECT_TRUE(std::isfinite(area));
  for (const MeshRegion& r : connected_regions(mesh, std::vector<int>(mesh.vertices.size(), 1)))
    EXPECT_TRUE(r.area > 0);
}

}  // namespace
}  // namespace orbitfuse
