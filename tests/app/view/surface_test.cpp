// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/surface.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "app/view/picture_parts.hpp"

namespace orbitfuse::view {
namespace {

PointCloud grid(int side, double spacing, bool thermal) {
  PointCloud cloud;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      cloud.positions.emplace_back(x * spacing, y * spacing, 0);
      if (thermal)
        cloud.temperatures_k.push_back(static_cast<float>(280 + x));
      else
        cloud.colors.push_back({1, 2, 3});
    }
  return cloud;
}

TEST(Surface, PointsTakeTheNearestTemperature) {
  PointCloud colored = grid(10, 1, false);
  for (Eigen::Vector3d& p : colored.positions) p.x() += 0.2;
  colored.positions.push_back({50, 0, 0});
  colored.colors.push_back({9, 9, 9});
  const PointCloud surface = surface_of(colored, grid(10, 1, true));
  ASSERT_EQ(surface.size(), 101u);
  for (std::size_t i = 0; i < surface.size(); ++i) {
    const double x = surface.positions[i].x();
    if (x == 50) {
      EXPECT_TRUE(std::isnan(surface.temperatures_k[i]));  // nothing thermal is near
      EXPECT_EQ(surface.colors[i][0], 9);
    } else {
      EXPECT_EQ(surface.temperatures_k[i], static_cast<float>(280 + std::floor(x)));
      EXPECT_EQ(surface.colors[i][0], 1);
    }
  }
}

TEST(Surface, OneModalityOrNoneIsTakenAsItIs) {
  EXPECT_EQ(surface_of({}, grid(3, 1, true)).temperatures_k.size(), 9u);
  EXPECT_TRUE(surface_of({}, grid(3, 1, true)).colors.empty());
  EXPECT_TRUE(surface_of(grid(3, 1, false), {}).temperatures_k.empty());
  EXPECT_TRUE(surface_of({}, {}).empty());
  EXPECT_EQ(packed({}, 0.01).size(), 28u);
}

TEST(Surface, PointsThatAreNoneAreLeftOut) {
  PointCloud cloud = grid(3, 1, false);
  cloud.positions[4].y() = std::nan("");
  EXPECT_EQ(surface_of(cloud, {}).size(), 8u);
  PointCloud all_nan = grid(2, 1, true);
  for (Eigen::Vector3d& p : all_nan.positions) p.x() = std::nan("");
  EXPECT_TRUE(surface_of(grid(2, 1, false), all_nan).temperatures_k.empty());
}

TEST(Surface, LargeCloudsAreThinnedEvenly) {
  const PointCloud thinned = surface_of(grid(1000, 1, false), {});
  ASSERT_EQ(thinned.size(), 300'000u);
  // The first hundredth alone has about as many points in each quarter.
  int quarters[4] = {};
  for (std::size_t i = 0; i < 3000; ++i)
    ++quarters[(thinned.positions[i].x() < 500) + 2 * (thinned.positions[i].y() < 500)];
  for (const int count : quarters) EXPECT_NEAR(count, 750, 100);
}

TEST(Surface, PackedPositionsAndTemperaturesComeBack) {
  PointCloud cloud = grid(3, 0.5, true);
  cloud.temperatures_k[3] = std::numeric_limits<float>::quiet_NaN();
  const std::string bytes = packed(cloud, 0.01);
  ASSERT_EQ(bytes.size(), 28u + 9 * 9 + 1 + 18);
  float low[3], step[3];
  std::memcpy(low, bytes.data() + 4, 12);
  std::memcpy(step, bytes.data() + 16, 12);
  for (std::size_t i = 0; i < 9; ++i) {
    std::uint16_t at[3], count = 0;
    std::memcpy(at, bytes.data() + 28 + 6 * i, 6);
    for (int d = 0; d < 3; ++d)
      EXPECT_NEAR(static_cast<double>(low[d] + step[d] * static_cast<float>(at[d])),
                  cloud.positions[i][d], 1e-4);
    std::memcpy(&count, bytes.data() + 28 + 81 + 1 + 2 * i, 2);
    EXPECT_EQ(count, i == 3 ? 0 : static_cast<int>(28000 + 100 * (i % 3)));
  }
}

TEST(Surface, PackedTrianglesFollowTheirVertices) {
  TriangleMesh mesh;
  mesh.vertices = grid(3, 0.5, true);
  mesh.vertices.temperatures_k[8] = 1500;  // of a coarser scale
  mesh.triangles = {{0, 1, 3}, {4, 8, 5}};
  const std::string bytes = packed(mesh);
  std::uint32_t count = 0;
  float scale = 0;
  std::memcpy(&count, bytes.data(), 4);
  std::memcpy(&scale, bytes.data() + 4, 4);
  EXPECT_EQ(count, 2U);
  const std::string vertices = packed(mesh.vertices, static_cast<double>(scale));
  EXPECT_EQ(bytes.substr(8, vertices.size()), vertices);
  const std::size_t at = (8 + vertices.size() + 3) / 4 * 4;
  ASSERT_EQ(bytes.size(), at + 24);
  std::uint32_t corners[6];
  std::memcpy(corners, bytes.data() + at, 24);
  EXPECT_THAT(corners, ::testing::ElementsAre(0, 1, 3, 4, 8, 5));
  std::uint16_t hottest = 0;
  std::memcpy(&hottest, bytes.data() + 8 + vertices.size() - 2, 2);
  EXPECT_NEAR(hottest * static_cast<double>(scale), 1500, 0.04);
}

TEST(PictureParts, LevelsKeepWhatIsNoneApartFromZero) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const cv::Mat levels = (cv::Mat_<float>(1, 5) << 0, 255, nan, 12.5f, nan);
  for (const bool gray : {true, false}) {
    PictureParts parts;
    parts.add_levels("thermal", levels, gray);
    const std::string bytes = parts.bytes();
    std::uint32_t length = 0;
    std::memcpy(&length, bytes.data(), 4);
    EXPECT_EQ(length % 4, 0u);
    const auto head = nlohmann::json::parse(bytes.substr(4, length)).at("parts").at(0);
    std::uint16_t counts[5];
    ASSERT_EQ(bytes.size(), 4 + length + 10);
    std::memcpy(counts, bytes.data() + 4 + length, 10);
    const auto value = [&](int i) {
      return counts[i] * head.at("scale").get<double>() + head.at("offset").get<double>();
    };
    EXPECT_EQ(counts[0] != 0, gray);  // 0 K is no temperature, gray level 0 is one
    if (gray) {
      EXPECT_NEAR(value(0), 0, 1e-9);
    }
    EXPECT_NEAR(value(1), 255, 0.01);
    EXPECT_EQ(counts[2], 0);
    EXPECT_NEAR(value(3), 12.5, 0.01);
  }
}

/// A furnace beside a cold wall.
TEST(PictureParts, HotScenesGetACoarserScale) {
  PictureParts parts;
  parts.add_levels("thermal", (cv::Mat_<float>(1, 2) << 290, 1500), false);
  const std::string bytes = parts.bytes();
  std::uint32_t length = 0;
  std::memcpy(&length, bytes.data(), 4);
  const auto head = nlohmann::json::parse(bytes.substr(4, length)).at("parts").at(0);
  std::uint16_t counts[2];
  std::memcpy(counts, bytes.data() + 4 + length, 4);
  EXPECT_NEAR(counts[1] * head.at("scale").get<double>(), 1500, 0.04);
}

}  // namespace
}  // namespace orbitfuse::view
