// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/v4l2/pixels.hpp"

#include <gtest/gtest.h>
#include <linux/videodev2.h>

namespace orbitfuse::v4l2 {
namespace {

TEST(V4l2Pixels, GreyWithPaddedRows) {
  const Layout layout{V4L2_PIX_FMT_GREY, 3, 2, 4};
  const std::vector<std::uint8_t> bytes{1, 2, 3, 99, 4, 5, 6};  // the last padding may be missing
  Frame frame;
  ASSERT_TRUE(unpack(bytes, layout, frame));
  EXPECT_EQ(frame.pixels.at<std::uint8_t>(0, 2), 3);
  EXPECT_EQ(frame.pixels.at<std::uint8_t>(1, 0), 4);
}

TEST(V4l2Pixels, GreyInYuyvStaysGrey) {
  const Layout layout{V4L2_PIX_FMT_YUYV, 2, 1, 4};
  Frame frame;
  ASSERT_TRUE(unpack(std::vector<std::uint8_t>{126, 128, 126, 128}, layout, frame));
  const auto pixel = frame.pixels.at<cv::Vec3b>(0, 1);
  EXPECT_EQ(pixel[0], pixel[1]);
  EXPECT_EQ(pixel[1], pixel[2]);
  EXPECT_NEAR(pixel[0], 128, 1);
}

TEST(V4l2Pixels, Nv12HasHalfHeightChroma) {
  const Layout layout{V4L2_PIX_FMT_NV12, 4, 2, 4};
  Frame frame;
  EXPECT_TRUE(unpack(std::vector<std::uint8_t>(12, 128), layout, frame));
  EXPECT_EQ(frame.pixels.size(), cv::Size(4, 2));
  EXPECT_FALSE(unpack(std::vector<std::uint8_t>(11, 128), layout, frame));
}

TEST(V4l2Pixels, LayoutsThatCannotBeAreDamageNotTheEnd) {
  Frame frame;
  const std::vector<std::uint8_t> bytes(4096, 7);
  for (const Layout& layout :
       {Layout{V4L2_PIX_FMT_Y16, 8, 4, 17}, Layout{V4L2_PIX_FMT_YUYV, 7, 4, 16},
        Layout{V4L2_PIX_FMT_NV12, 7, 4, 8}, Layout{V4L2_PIX_FMT_NV12, 8, 3, 8},
        Layout{V4L2_PIX_FMT_GREY, 0, 4, 8}, Layout{V4L2_PIX_FMT_GREY, 8, 0, 8},
        Layout{V4L2_PIX_FMT_GREY, -8, -4, -8}})
    EXPECT_FALSE(unpack(bytes, layout, frame)) << fourcc_text(layout.fourcc);
  EXPECT_TRUE(unpack(bytes, {V4L2_PIX_FMT_GREY, 7, 3, 9}, frame));
}

TEST(V4l2Pixels, Y16StaysAsItIs) {
  const Layout layout{V4L2_PIX_FMT_Y16, 1, 1, 2};
  const std::uint16_t count = 12345;
  Frame frame;
  ASSERT_TRUE(unpack({reinterpret_cast<const std::uint8_t*>(&count), 2}, layout, frame));
  EXPECT_EQ(frame.pixels.at<std::uint16_t>(0, 0), 12345);
  EXPECT_TRUE(frame.flags.empty());
}

TEST(V4l2Pixels, CutJpegIsDamage) {
  const Layout layout{V4L2_PIX_FMT_MJPEG, 2, 2, 0};
  Frame frame;
  EXPECT_TRUE(unpack(std::vector<std::uint8_t>{0xff, 0xd8, 1, 2, 0xff, 0xd9, 0, 0}, layout, frame));
  EXPECT_EQ(frame.encoded.size(), 6u);  // zero padding is not part of the image
  EXPECT_FALSE(unpack(std::vector<std::uint8_t>{0xff, 0xd8, 1, 2, 3}, layout, frame));
  EXPECT_FALSE(unpack(std::vector<std::uint8_t>{0, 0, 1, 2, 0xff, 0xd9}, layout, frame));
  EXPECT_FALSE(unpack(std::vector<std::uint8_t>{}, layout, frame));
  EXPECT_FALSE(unpack(std::vector<std::uint8_t>{0xff, 0xd8, 0, 0, 0}, layout, frame));
}

}  // namespace
}  // namespace orbitfuse::v4l2
