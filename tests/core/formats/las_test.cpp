// SPDX-License-Identifier: BSD-3-Clause
#include "core/formats/las.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "core/system/file_io.hpp"

namespace orbitfuse {
namespace {
namespace fs = std::filesystem;

/// A test's own: ctest runs them side by side.
fs::path las_file() {
  const std::string test = ::testing::UnitTest::GetInstance()->current_test_info()->name();
  return fs::path(::testing::TempDir()) / ("orbitfuse_" + test + ".las");
}

template <class T>
T at(const std::string& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

PointCloud cloud() {
  PointCloud c;
  c.positions = {{-1.5, 2, 3}, {4, 5.25, -6}};
  c.colors = {{255, 0, 1}, {2, 3, 4}};
  c.temperatures_k = {300.5F, std::numeric_limits<float>::quiet_NaN()};
  return c;
}

// Offsets are those of the specification (LAS 1.4 R15, tables 3, 13, 16 and 24).
TEST(Las, IsAsTheSpecificationHasIt) {
  ASSERT_TRUE(write_las(las_file(), cloud()));
  const std::string b = *read_file(las_file());
  EXPECT_EQ(b.substr(0, 4), "LASF");
  EXPECT_EQ(at<std::uint8_t>(b, 24), 1);
  EXPECT_EQ(at<std::uint8_t>(b, 25), 4);
  EXPECT_EQ(at<std::uint16_t>(b, 94), 375);
  const auto points = at<std::uint32_t>(b, 96);
  EXPECT_EQ(points, 375U + 54 + 192);
  EXPECT_EQ(at<std::uint32_t>(b, 100), 1U);
  EXPECT_EQ(at<std::uint8_t>(b, 104), 7);
  EXPECT_EQ(at<std::uint16_t>(b, 105), 40);
  EXPECT_EQ(at<std::uint64_t>(b, 247), 2U);
  ASSERT_EQ(b.size(), points + 2 * 40U);
  for (std::size_t i = 0; i < 2; ++i)
    for (std::size_t d = 0; d < 3; ++d) {
      const double x = at<std::int32_t>(b, points + 40 * i + 4 * d) * at<double>(b, 131 + 8 * d) +
                       at<double>(b, 155 + 8 * d);
      EXPECT_NEAR(x, cloud().positions[i][static_cast<Eigen::Index>(d)], 1e-6);
      EXPECT_EQ(at<std::uint16_t>(b, points + 40 * i + 30 + 2 * d), 257 * cloud().colors[i][d]);
    }
  EXPECT_EQ(at<double>(b, 179), 4);     // greatest x
  EXPECT_EQ(at<double>(b, 187), -1.5);  // least x
  EXPECT_EQ(b.substr(375 + 2, 9), "LASF_Spec");
  EXPECT_EQ(at<std::uint16_t>(b, 375 + 18), 4);
  EXPECT_EQ(at<std::uint8_t>(b, 375 + 54 + 2), 9);
  EXPECT_EQ(b.substr(375 + 54 + 4, 12), std::string("temperature\0", 12));
  EXPECT_EQ(at<float>(b, points + 36), 300.5F);
  EXPECT_TRUE(std::isnan(at<float>(b, points + 40 + 36)));
}

TEST(Las, HugeCloudsKeepTheirForm) {
  PointCloud c;
  c.positions = {{-1e9, 0, 0}, {1e9, 0, 0}};
  ASSERT_TRUE(write_las(las_file(), c));
  const std::string b = *read_file(las_file());
  EXPECT_EQ(at<std::uint16_t>(b, 105), 36);
  const double x = at<std::int32_t>(b, 375 + 36) * at<double>(b, 131) + at<double>(b, 155);
  EXPECT_NEAR(x, 1e9, 1);
}

TEST(Las, EmptyAndBrokenCloudsAreRefused) {
  EXPECT_FALSE(write_las(las_file(), {}));
  PointCloud c = cloud();
  c.positions[1].y() = std::nan("");
  EXPECT_FALSE(write_las(las_file(), c));
  c.positions[1].y() = 1e300;
  EXPECT_FALSE(write_las(las_file(), c));
}

}  // namespace
}  // namespace orbitfuse
