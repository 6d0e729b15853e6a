// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>

#include "app/stages/artifacts.hpp"
#include "core/system/file_io.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::stages {
namespace {
namespace fs = std::filesystem;

std::vector<DepthMap> some_maps() {
  std::vector<DepthMap> maps;
  for (int i = 0; i < 3; ++i) {
    DepthMap map;
    map.view = i;
    map.camera = Camera::from_fov(8, 6, 40);
    map.depth = cv::Mat(6, 8, CV_32FC1, cv::Scalar(1.0 + i));
    map.confidence = cv::Mat(6, 8, CV_32FC1, cv::Scalar(0.5));
    map.normal = cv::Mat(6, 8, CV_32FC3, cv::Scalar(0, 0, -1));
    maps.push_back(map);
  }
  return maps;
}

TEST(DepthMaps, AreReadAsTheyWereWritten) {
  const test::TempFolder temp;
  ASSERT_TRUE(save_depth_maps(temp.path(), some_maps()));
  const auto read = load_depth_maps(temp.path());
  ASSERT_TRUE(read) << read.error().message();
  ASSERT_EQ(read->size(), 3u);
  EXPECT_EQ((*read)[2].depth.at<float>(3, 3), 3.0F);
  EXPECT_EQ((*read)[1].normal.at<cv::Vec3f>(0, 0), cv::Vec3f(0, 0, -1));
}

TEST(DepthMaps, ThatCantAllBeWrittenLeaveTheirRoom) {
  for (const char* blocked : {"002_normal_z.tiff", "depth.json"}) {
    const test::TempFolder temp;
    fs::create_directory(temp.path() / blocked);  // no file can take its name
    ASSERT_TRUE(write_file_atomic(temp.path() / blocked / "in the way", "x"));
    const Status written = save_depth_maps(temp.path(), some_maps());
    ASSERT_FALSE(written);
    EXPECT_NE(written.error().message().find(blocked), std::string::npos);
    for (const auto& entry : fs::directory_iterator(temp.path()))
      EXPECT_TRUE(entry.path().filename() == blocked) << entry.path() << ", " << blocked;
  }
}

}  // namespace
}  // namespace orbitfuse::stages
