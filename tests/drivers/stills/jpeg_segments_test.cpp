// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/jpeg_segments.hpp"

#include <gtest/gtest.h>

#include <string>

namespace orbitfuse {
namespace {
using namespace std::string_view_literals;

TEST(JpegSegments, InOrderUpToThePicture) {
  const auto jpeg =
      "\xff\xd8\xff\xe1\0\5abc\xff\xff\xe3\0\2\xff\xe1\0\4de\xff\xda\0\4xx\xff\xe1\0\3z"sv;
  const auto segments = jpeg_segments(jpeg);
  ASSERT_EQ(segments.size(), 3u);
  EXPECT_EQ(segments[0].marker, 0xe1);
  EXPECT_EQ(segments[0].payload, "abc");
  EXPECT_EQ(segments[1].marker, 0xe3);  // after a fill byte, and empty
  EXPECT_EQ(segments[1].payload, "");
  EXPECT_EQ(segments[2].payload, "de");
}

TEST(JpegSegments, OfDamagedOnesThoseThatAreWhole) {
  const auto jpeg = "\xff\xd8\xff\xe1\0\5abc\xff\xe3\0\6wxyz"sv;
  for (std::size_t size = 0; size <= jpeg.size(); ++size) {
    const auto segments = jpeg_segments(jpeg.substr(0, size));
    EXPECT_EQ(segments.size(), size < 9 ? 0u : size < jpeg.size() ? 1u : 2u) << size;
  }
  EXPECT_TRUE(jpeg_segments("\xff\xd8\xff\xe1\0\1abc"sv).empty());  // shorter than its length
  EXPECT_TRUE(jpeg_segments("\xff\xd8\xff\xe1\xff\xffshort"sv).empty());
  EXPECT_TRUE(jpeg_segments(std::string(100'000, '\xff')).empty());
}

}  // namespace
}  // namespace orbitfuse
