// SPDX-License-Identifier: BSD-3-Clause
// LAS in the readers of others, from npm (las_readers/package.json): every point's place, colour
// and temperature.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "core/formats/las.hpp"
#include "core/system/file_io.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {
namespace fs = std::filesystem;

/// Far from the origin and with every kind of number: negative, tiny, no temperature.
PointCloud spiral(bool temperatures) {
  PointCloud cloud;
  for (int i = 0; i < 3000; ++i) {
    const double turn = 0.1 * i;
    cloud.positions.emplace_back(120.5 + 3.25 * std::sin(turn), 0.01 * i - 4, std::cos(turn) / 7);
    cloud.colors.push_back({static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(i / 12), 7});
    if (temperatures) cloud.temperatures_k.push_back(255.37F + 0.0371F * static_cast<float>(i));
  }
  if (temperatures) cloud.temperatures_k[7] = cloud.temperatures_k[2999] = std::nanf("");
  return cloud;
}

int shell(const std::string& command) { return std::system(command.c_str()); }

class LasReaders : public ::testing::Test {
 protected:
  void SetUp() override {
    if (shell("command -v node npm > /dev/null") != 0)
      GTEST_SKIP() << "node and npm are not installed";
    fs::copy(ORBITFUSE_SOURCE_DIR "/tests/app/export/las_readers", folder.path(),
             fs::copy_options::recursive);
    const fs::path log = folder.path() / "npm.log";
    if (shell("cd " + folder.path().string() +
              " && npm ci --ignore-scripts --no-audit --no-fund > npm.log 2>&1") != 0)
      GTEST_SKIP() << "the readers are not to be had: " << read_file(log).value_or("");
  }

  /// What the reader says of the file, then a row a point.
  std::string read(const std::string& reader, const PointCloud& cloud,
                   std::vector<std::vector<double>>& rows) {
    EXPECT_TRUE(write_las(folder.path() / "cloud.las", cloud));
    const int code = shell("cd " + folder.path().string() + " && node read_las.mjs " + reader +
                           " cloud.las > table 2> error");
    EXPECT_EQ(code, 0) << read_file(folder.path() / "error").value_or("");
    std::ifstream table(folder.path() / "table");
    std::string about, line, word;
    std::getline(table, about);
    while (std::getline(table, line)) {
      rows.emplace_back();
      for (std::istringstream words(line); words >> word;)
        rows.back().push_back(word == "NaN" ? std::nan("") : std::stod(word));
    }
    return about;
  }

  const test::TempFolder folder;
};

void expect_points(const PointCloud& cloud, const std::vector<std::vector<double>>& rows,
                   std::size_t columns, int color_step) {
  ASSERT_EQ(rows.size(), cloud.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    ASSERT_EQ(rows[i].size(), columns) << i;
    for (std::size_t d = 0; d < 3; ++d) {
      ASSERT_NEAR(rows[i][d], cloud.positions[i][static_cast<Eigen::Index>(d)], 0.51e-6) << i;
      ASSERT_EQ(rows[i][3 + d], color_step * cloud.colors[i][d]) << i;
    }
  }
}

TEST_F(LasReaders, CopcReadsPointsAndTheScalar) {
  const PointCloud cloud = spiral(true);
  std::vector<std::vector<double>> rows;
  EXPECT_EQ(read("copc", cloud, rows), "# 1.4 format 7 points 3000 extra temperature:float32");
  expect_points(cloud, rows, 7, 257);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const float kelvin = cloud.temperatures_k[i];
    if (std::isnan(kelvin))
      EXPECT_TRUE(std::isnan(rows[i][6])) << i;
    else
      ASSERT_EQ(static_cast<float>(rows[i][6]), kelvin) << i;
  }
}

TEST_F(LasReaders, CopcReadsPointsWithoutTemperatures) {
  const PointCloud cloud = spiral(false);
  std::vector<std::vector<double>> rows;
  EXPECT_EQ(read("copc", cloud, rows), "# 1.4 format 7 points 3000 extra ");
  expect_points(cloud, rows, 6, 257);
}

TEST_F(LasReaders, LoadersGlReadsPointsAndColours) {
  const PointCloud cloud = spiral(true);
  std::vector<std::vector<double>> rows;
  EXPECT_EQ(read("loaders", cloud, rows), "# 1.4 format 7 points 3000");
  expect_points(cloud, rows, 6, 1);
}

}  // namespace
}  // namespace orbitfuse
