// SPDX-License-Identifier: BSD-3-Clause
#include "core/formats/ply.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

using test::get;
using test::put;
using test::TempFolder;

TEST(Ply, BinaryRoundTripIsExact) {
  const TempFolder folder;
  PointCloud cloud;
  for (int i = 0; i < 100; ++i) {
    cloud.positions.emplace_back(i / 3.0, -i / 7.0, 1e-3 * i);
    cloud.normals.emplace_back(0.6F, 0.0F, 0.8F);
    cloud.colors.push_back({static_cast<std::uint8_t>(i), 2, 255});
    cloud.temperatures_k.push_back(290.0F + static_cast<float>(i));
  }
  cloud.temperatures_k[7] = std::nanf("");
  ASSERT_TRUE(write_ply(folder / "c.ply", cloud));
  const auto back = read_ply(folder / "c.ply");
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->positions, cloud.positions);
  EXPECT_EQ(back->normals, cloud.normals);
  EXPECT_EQ(back->colors, cloud.colors);
  EXPECT_TRUE(std::isnan(back->temperatures_k[7]));
  EXPECT_EQ(back->temperatures_k[99], 389.0F);
}

TEST(Ply, EmptyCloud) {
  const TempFolder folder;
  ASSERT_TRUE(write_ply(folder / "c.ply", {}));
  const auto back = read_ply(folder / "c.ply");
  ASSERT_TRUE(back);
  EXPECT_TRUE(back->empty());
}

TEST(Ply, AsciiWithForeignElementsAndProperties) {
  const TempFolder folder;
  put(folder / "a.ply",
      "ply\r\nformat ascii 1.0\r\ncomment x\r\nelement camera 1\r\nproperty list uchar int "
      "ids\r\nproperty float f\r\n"
      "element vertex 2\r\nproperty float x\r\nproperty float y\r\nproperty float z\r\nproperty "
      "float confidence\r\n"
      "property list uchar float extra\r\nelement face 1\r\nproperty list uchar int "
      "vertex_indices\r\nend_header\r\n"
      "3 7 8 9 1.5\r\n1 2 3 0.5 0\r\n-1e2 nan +4 0.5 2 7 8\r\n3 0 1 1\r\n");
  const auto cloud = read_ply(folder / "a.ply");
  ASSERT_TRUE(cloud) << cloud.error().message();
  ASSERT_EQ(cloud->size(), 2u);
  EXPECT_EQ(cloud->positions[0], Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(cloud->positions[1].x(), -100);
  EXPECT_TRUE(std::isnan(cloud->positions[1].y()));
  EXPECT_EQ(cloud->positions[1].z(), 4);
  EXPECT_TRUE(cloud->normals.empty());
}

TEST(Ply, BigEndian) {
  const TempFolder folder;
  put(folder / "b.ply",
      std::string("ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty float x\n"
                  "property short y\nproperty uchar z\nend_header\n") +
          std::string("\x3F\x80\x00\x00\xFF\xFE\x05", 7));
  const auto cloud = read_ply(folder / "b.ply");
  ASSERT_TRUE(cloud) << cloud.error().message();
  EXPECT_EQ(cloud->positions[0], Eigen::Vector3d(1, -2, 5));
}

TEST(Ply, TruncatedAtAnyByteIsAnError) {
  const TempFolder folder;
  PointCloud cloud;
  for (int i = 0; i < 5; ++i) cloud.positions.emplace_back(i, i, i);
  ASSERT_TRUE(write_ply(folder / "c.ply", cloud));
  const std::string bytes = get(folder / "c.ply");
  for (std::size_t keep = 0; keep < bytes.size(); ++keep) {
    put(folder / "cut.ply", bytes.substr(0, keep));
    ASSERT_FALSE(read_ply(folder / "cut.ply")) << keep;
  }
}

TEST(Ply, CountsLargerThanTheFileTakeNoMemory) {
  const TempFolder folder;
  for (const char* header :
       {"ply\nformat binary_little_endian 1.0\nelement vertex 18446744073709551615\nproperty float "
        "x\nproperty float y\nproperty float z\nend_header\nabc",
        "ply\nformat ascii 1.0\nelement vertex 999999999999\nproperty float x\nproperty float "
        "y\nproperty float z\nend_header\n1 2 3\n",
        "ply\nformat binary_little_endian 1.0\nelement junk 99999999999\nelement vertex "
        "1\nproperty float x\nend_header\n",
        "ply\nformat ascii 1.0\nelement vertex -3\nproperty float x\nproperty float y\nproperty "
        "float z\nend_header\n",
        "ply\nformat ascii 1.0\nelement face 1\nproperty list double int i\nelement vertex "
        "1\nproperty float x\nproperty float y\nproperty float z\nend_header\n4e102 1\n1 2 3\n"}) {
    put(folder / "h.ply", header);
    EXPECT_FALSE(read_ply(folder / "h.ply")) << header;
  }
}

TEST(Ply, CountsBelowZeroAndPropertiesGivenTwiceAreNamed) {
  const TempFolder folder;
  const auto refused = [&](const std::string& count, const std::string& second) {
    put(folder / "a.ply", "ply\nformat ascii 1.0\nelement vertex " + count +
                              "\nproperty float x\nproperty float " + second +
                              "\nproperty float z\nend_header\n1 2 3\n");
    const auto cloud = read_ply(folder / "a.ply");
    return cloud ? std::string() : cloud.error().found;
  };
  EXPECT_EQ(refused("1", "y"), "");
  EXPECT_EQ(refused("-1", "y"), "unreadable line \"element vertex -1\"");
  EXPECT_EQ(refused("1", "x"), "two properties x");
}

TEST(Ply, WrongTypesAreNamed) {
  const TempFolder folder;
  put(folder / "t.ply",
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty text x\nend_header\n1\n");
  EXPECT_NE(read_ply(folder / "t.ply").error().message().find("text"), std::string::npos);
  put(folder / "n.ply", "solid cube\n");
  EXPECT_FALSE(read_ply(folder / "n.ply"));
  put(folder / "x.ply",
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n1 "
      "2\n");
  EXPECT_FALSE(read_ply(folder / "x.ply"));
}

TEST(Ply, PositionsThatCannotBeComputedWithAreNone) {
  const TempFolder folder;
  put(folder / "c.ply",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty "
      "double z\n"
      "end_header\n1 2 3\n1e300 0 0\nnan 1 1\n");
  const auto cloud = read_ply(folder / "c.ply");
  ASSERT_TRUE(cloud) << cloud.error().message();
  EXPECT_EQ(cloud->positions.at(0), Eigen::Vector3d(1, 2, 3));
  EXPECT_TRUE(cloud->positions.at(1).array().isNaN().all());
  EXPECT_TRUE(std::isnan(cloud->positions.at(2).x()));
}

}  // namespace
}  // namespace orbitfuse
