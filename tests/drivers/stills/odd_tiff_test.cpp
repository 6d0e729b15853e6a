// SPDX-License-Identifier: BSD-3-Clause
// TIFFs whose samples would be taken for others: read as what they are, or refused by name.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/image/image_codec.hpp"
#include "tests/support/made_files.hpp"

namespace orbitfuse {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(OddTiff, ColoursThatAreNotReadAreNamed) {
  const cv::Mat page(6, 12, CV_8UC1, cv::Scalar(40));
  const struct {
    int photometric, channels, planar;
    const char* words;
  } cases[] = {{5, 4, 1, "CMYK"},  {8, 3, 1, "Lab"},  {2, 3, 2, "planar"},
               {6, 3, 1, "YCbCr"}, {4, 1, 1, "mask"}, {32803, 1, 1, "unknown kind"}};
  for (const auto& c : cases) {
    made::TiffWords words;
    words.photometric = c.photometric;
    words.channels = c.channels;
    words.planar = c.planar;
    const auto image = decode_tiff(made::tiff_of_pages({page}, words), "odd.tif");
    ASSERT_FALSE(image) << c.words;
    EXPECT_THAT(image.error().message(), AllOf(HasSubstr("odd.tif"), HasSubstr(c.words)));
  }
  made::TiffWords rgb;
  rgb.photometric = 2;
  rgb.channels = 3;
  const auto image = decode_tiff(made::tiff_of_pages({page}, rgb), "rgb.tif");
  ASSERT_TRUE(image) << image.error().message();
  EXPECT_EQ(image->type(), CV_8UC3);
  EXPECT_EQ(image->cols, 4);
}

TEST(OddTiff, WhereZeroIsWhiteBytesAreTurnedAndCountsRefused) {
  made::TiffWords words;
  words.photometric = 0;
  const auto turned =
      decode_tiff(made::tiff_of_pages({cv::Mat(4, 5, CV_8UC1, cv::Scalar(40))}, words), "w.tif");
  ASSERT_TRUE(turned) << turned.error().message();
  EXPECT_EQ(turned->at<std::uint8_t>(2, 3), 215);
  const auto counts =
      decode_tiff(made::tiff_of_pages({cv::Mat(4, 5, CV_16UC1, cv::Scalar(40))}, words), "w.tif");
  ASSERT_FALSE(counts);
  EXPECT_THAT(counts.error().message(), HasSubstr("0 is white"));
}

TEST(OddTiff, GdalsScaleIsTheTags) {
  const cv::Mat page(4, 5, CV_16UC1, cv::Scalar(7000));
  made::TiffWords words;
  const auto scale = [&]() -> Result<std::optional<ThermalScaleTag>> {
    std::string description;
    ORBITFUSE_TRY(decode_tiff(made::tiff_of_pages({page}, words), "g.tif", &description));
    return thermal_scale_of_description(description, "g.tif");
  };
  words.gdal_metadata =
      "<GDALMetadata>\n  <Item name=\"OFFSET\" sample=\"0\" role=\"offset\">10.5</Item>\n"
      "  <Item name=\"SCALE\" sample=\"0\" role=\"scale\">0.04</Item>\n</GDALMetadata>\n";
  auto tag = scale();
  ASSERT_TRUE(tag && *tag) << (tag ? "no tag" : tag.error().message());
  EXPECT_EQ((*tag)->scale, 0.04);
  EXPECT_EQ((*tag)->offset, 10.5);
  words.description = R"({"scale":0.02,"offset":0})";
  tag = scale();
  ASSERT_TRUE(tag && *tag);
  EXPECT_EQ((*tag)->scale, 0.02) << "the file's own tag wins";
  words.description = "";
  words.gdal_metadata = "<Item name=\"SCALE\" role=\"scale\">much</Item>";
  tag = scale();
  ASSERT_FALSE(tag);
  EXPECT_THAT(tag.error().message(), AllOf(HasSubstr("g.tif"), HasSubstr("GDAL")));
  for (const char* without_scale :
       {"<Item name=\"STATISTICS_MEAN\">7000</Item>", "<GDALMetadata/>", "<GDALMetadata />\n"}) {
    words.gdal_metadata = without_scale;
    tag = scale();
    ASSERT_TRUE(tag) << without_scale << tag.error().message();
    EXPECT_FALSE(*tag) << without_scale;
  }
}

/// libtiff reads the header's bytes as the first samples.
TEST(OddTiff, AStripThatBeginsInTheHeaderIsNamed) {
  const cv::Mat page(6, 8, CV_16UC1, cv::Scalar(29500));
  const std::string whole = made::tiff_of_pages({page});
  const std::string strip_offsets("\x11\x01\x04\x00\x01\x00\x00\x00", 8);
  const std::size_t entry = whole.find(strip_offsets);
  ASSERT_NE(entry, whole.npos);
  for (const char at : {0, 4, 7}) {
    std::string bytes = whole;
    bytes.replace(entry + 8, 4, std::string(1, at) + std::string(3, '\0'));
    const auto image = decode_tiff(bytes, "h.tif");
    ASSERT_FALSE(image) << int{at};
    EXPECT_THAT(image.error().message(),
                AllOf(HasSubstr("h.tif"),
                      HasSubstr("strip 1 of its samples begins at byte " + std::to_string(at))));
  }
  EXPECT_TRUE(decode_tiff(whole, "h.tif"));
}

/// Passed over, the counts would be looked at instead, and raw ones taken for centikelvin.
TEST(OddTiff, AScaleThatIsCutOffIsNamed) {
  const std::string whole =
      R"({"quantity":"temperature","unit":"kelvin","scale":0.04,"offset":10})";
  for (const std::size_t keep : {27ul, 40ul, 51ul, 56ul, whole.size() - 1}) {
    const auto tag = thermal_scale_of_description(whole.substr(0, keep), "c.tif");
    ASSERT_FALSE(tag) << whole.substr(0, keep);
    EXPECT_THAT(tag.error().message(), AllOf(HasSubstr("c.tif"), HasSubstr("cut off")));
  }
  const auto nan = thermal_scale_of_description(R"({"scale":0.04,"min":NaN})", "c.tif");
  ASSERT_FALSE(nan) << "Python writes NaN, which is no JSON";
  // What other programs write there is none of it.
  for (const char* words :
       {"", "ImageJ=1.53t", "{camera 7}", "a \"scale\" of 3", R"({"shape":[2]})"}) {
    const auto tag = thermal_scale_of_description(words, "c.tif");
    ASSERT_TRUE(tag) << words;
    EXPECT_FALSE(*tag) << words;
  }
  made::TiffWords words;
  const std::string metadata =
      "<GDALMetadata>\n  <Item name=\"SCALE\" sample=\"0\" role=\"scale\">0.04</Item>\n"
      "  <Item name=\"OFFSET\" sample=\"0\" role=\"offset\">10.5</Item>\n</GDALMetadata>\n";
  for (const std::size_t keep : {30ul, 62ul, 90ul, 140ul}) {
    words.gdal_metadata = metadata.substr(0, keep);
    std::string description;
    ASSERT_TRUE(decode_tiff(made::tiff_of_pages({cv::Mat(4, 5, CV_16UC1, cv::Scalar(7000))}, words),
                            "g.tif", &description));
    const auto tag = thermal_scale_of_description(description, "g.tif");
    ASSERT_FALSE(tag) << words.gdal_metadata;
    EXPECT_THAT(tag.error().message(), AllOf(HasSubstr("g.tif"), HasSubstr("GDAL")));
  }
}

/// Programs put a small picture of the image before it.
TEST(OddTiff, AReducedCopyInFrontIsNotTheImage) {
  const cv::Mat copy(3, 4, CV_8UC1, cv::Scalar(1)), image(6, 8, CV_16UC1, cv::Scalar(7000));
  made::TiffWords words;
  words.subfile_of_first = 1;
  const std::string bytes = made::tiff_of_pages({copy, image}, words);
  const auto read = decode_tiff(bytes, "p.tif");
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(cv::norm(*read, image, cv::NORM_INF), 0);
  EXPECT_EQ(tiff_page_count(bytes), 1);
  const auto alone = decode_tiff(made::tiff_of_pages({copy}, words), "p.tif");
  ASSERT_TRUE(alone) << alone.error().message();
  EXPECT_EQ(alone->cols, 4) << "all there is";
}

}  // namespace
}  // namespace orbitfuse
