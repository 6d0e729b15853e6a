// SPDX-License-Identifier: BSD-3-Clause
#include "core/image/image_io.hpp"

#include <gtest/gtest.h>
#include <png.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/image/exif.hpp"
#include "core/image/image_codec.hpp"
#include "core/image/transparency.hpp"
#include "core/system/file_io.hpp"
#include "core/temperature.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

using test::get;
using test::put;
using test::TempFolder;

cv::Mat gradient_bgr(int width = 64, int height = 48) {
  cv::Mat image(height, width, CV_8UC3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x)
      image.at<cv::Vec3b>(y, x) =
          cv::Vec3b(static_cast<uchar>(3 * x), static_cast<uchar>(4 * y), 90);
  }
  return image;
}

double max_difference(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() ? cv::norm(a, b, cv::NORM_INF) : 1e9;
}

/// A JPEG with a minimal EXIF block that holds nothing but the orientation.
std::string with_orientation(const std::string& jpeg, int orientation) {
  std::string exif("Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0", 24);
  exif += static_cast<char>(orientation);
  exif += std::string("\0\0\0\0\0\0\0", 7);
  std::string segment = "\xFF\xE1";
  segment += static_cast<char>((exif.size() + 2) >> 8);
  segment += static_cast<char>((exif.size() + 2) & 0xFF);
  return jpeg.substr(0, 2) + segment + exif + jpeg.substr(2);
}

TEST(ImageIo, PngAndJpegRoundTrip) {
  const TempFolder folder;
  const cv::Mat image = gradient_bgr();
  ASSERT_TRUE(write_png(folder / "a.png", image));
  ASSERT_TRUE(write_jpeg(folder / "a.jpg", image, 98));
  EXPECT_EQ(max_difference(*read_visible(folder / "a.png"), image), 0);
  EXPECT_LT(max_difference(*read_visible(folder / "a.jpg"), image), 16);
  EXPECT_LT(cv::norm(*read_visible(folder / "a.jpg"), image, cv::NORM_L1) /
                static_cast<double>(image.total()),
            6);
}

TEST(ImageIo, GreyPhotoBecomesBgr) {
  const TempFolder folder;
  const cv::Mat grey(20, 30, CV_8UC1, cv::Scalar(77));
  ASSERT_TRUE(write_jpeg(folder / "g.jpg", grey));
  const auto image = read_visible(folder / "g.jpg");
  ASSERT_TRUE(image);
  EXPECT_EQ(image->type(), CV_8UC3);
  EXPECT_EQ(read_image(folder / "g.jpg")->type(), CV_8UC1);
}

TEST(ImageIo, ExifOrientationIsAppliedOnce) {
  const TempFolder folder;
  cv::Mat stored(40, 64, CV_8UC3, cv::Scalar(0, 0, 0));
  stored(cv::Rect(0, 0, 32, 20)).setTo(cv::Scalar(255, 255, 255));  // marks the stored top left
  const std::string jpeg = *encode_jpeg(stored, 95);
  // Where the stored top-left quarter appears upright, and whether sides swap (TIFF 6.0, tag 274).
  const struct {
    int orientation;
    bool right, bottom, swapped;
  } cases[] = {{1, false, false, false}, {2, true, false, false}, {3, true, true, false},
               {4, false, true, false},  {5, false, false, true}, {6, true, false, true},
               {7, true, true, true},    {8, false, true, true}};
  for (const auto& c : cases) {
    put(folder / "o.jpg", with_orientation(jpeg, c.orientation));
    const auto image = read_visible(folder / "o.jpg");
    ASSERT_TRUE(image) << image.error().message();
    EXPECT_EQ(image->cols, c.swapped ? 40 : 64) << c.orientation;
    const int x = c.right ? image->cols - 6 : 5, y = c.bottom ? image->rows - 6 : 5;
    EXPECT_GT(image->at<cv::Vec3b>(y, x)[0], 200) << c.orientation;
    EXPECT_LT(image->at<cv::Vec3b>(image->rows - 1 - y, image->cols - 1 - x)[0], 50)
        << c.orientation;
  }
  put(folder / "o.jpg", with_orientation(jpeg, 99));
  EXPECT_EQ(read_visible(folder / "o.jpg")->cols, 64);
}

TEST(ImageIo, EveryTruncationIsAnErrorThatNamesTheFile) {
  const TempFolder folder;
  const cv::Mat thermal(48, 64, CV_16UC1, cv::Scalar(29315));
  const cv::Mat noise = gradient_bgr();
  for (const auto& [file, bytes] :
       {std::pair<std::string, std::string>{"t.jpg", *encode_jpeg(noise, 95)},
        {"t.png", *encode_png(noise)},
        {"t.tiff", *encode_thermal_tiff(thermal)}}) {
    for (std::size_t keep = 0; keep + 3 < bytes.size(); keep += 1 + bytes.size() / 97) {
      put(folder / file, bytes.substr(0, keep));
      const auto image = read_image(folder / file);
      ASSERT_FALSE(image) << file << " cut to " << keep << " of " << bytes.size();
      EXPECT_EQ(image.error().kind, ErrorKind::input);
      EXPECT_NE(image.error().message().find(file), std::string::npos);
    }
  }
}

TEST(ImageIo, DamagedBytesNeverCrash) {
  const TempFolder folder;
  const cv::Mat thermal(48, 64, CV_16UC1, cv::Scalar(29315));
  std::uint32_t state = 12345;
  for (const std::string& whole : {*encode_jpeg(gradient_bgr(), 90), *encode_png(gradient_bgr()),
                                   *encode_thermal_tiff(thermal)}) {
    for (int round = 0; round < 150; ++round) {
      std::string bytes = whole;
      for (int k = 0; k < 4; ++k) {
        state = state * 1664525u + 1013904223u;
        bytes[(state >> 8) % bytes.size()] = static_cast<char>(state >> 3);
      }
      (void)decode_image(bytes, "damaged");  // an image or an error, within the sanitizers
    }
  }
}

TEST(ImageIo, AVideoInsideATiffsHeaderIsNotWalkedForItsExif) {
  // Found by the fuzzer: 102 bytes that kept Exiv2's video reader busy for minutes.
  const std::string bytes =
      *read_file(ORBITFUSE_SOURCE_DIR "/tests/fuzz/cases/photo/exif_of_a_video_without_end");
  ASSERT_EQ(bytes.size(), 102u);
  EXPECT_FALSE(read_exif(bytes).focal_mm);
  EXPECT_FALSE(decode_image(bytes, "f"));
}

TEST(ImageIo, OtherContentUnderTheNameIsToldApart) {
  const TempFolder folder;
  put(folder / "text.jpg", "this is not an image");
  put(folder / "empty.png", "");
  for (const char* file : {"text.jpg", "empty.png"}) EXPECT_FALSE(read_visible(folder / file));
  // A PNG named .jpg is still an image.
  put(folder / "png.jpg", *encode_png(gradient_bgr()));
  EXPECT_TRUE(read_visible(folder / "png.jpg"));
}

TEST(ImageIo, APngOfImpossibleSizeIsRefused) {
  std::string bytes = *encode_png(gradient_bgr());
  for (std::size_t at = 16; at < 24; ++at) bytes[at] = '\xff';
  const auto image = decode_image(bytes, "huge.png");
  ASSERT_FALSE(image);
  EXPECT_EQ(image.error().where, "huge.png");
  EXPECT_TRUE(image.error().found.find("PNG") != std::string::npos) << image.error().found;
}

/// A PNG as libpng's own encoder writes it, of any kind; samples are 0, 1, 2 ... `clear`: one entry
/// of a palette, or one grey, is transparent.
std::string png_of(int width, int height, int bits, int kind, bool interlaced, bool clear = false) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  std::string out;
  png_set_write_fn(
      png, &out,
      [](png_structp p, png_bytep bytes, std::size_t n) {
        static_cast<std::string*>(png_get_io_ptr(p))->append(reinterpret_cast<char*>(bytes), n);
      },
      nullptr);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), bits,
               kind, interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE, 0, 0);
  const png_color colors[4] = {{1, 2, 3}, {40, 50, 60}, {70, 80, 90}, {100, 110, 120}};
  if (kind == PNG_COLOR_TYPE_PALETTE) png_set_PLTE(png, info, colors, 4);
  png_byte alpha[2] = {255, 0};
  png_color_16 gray{};
  gray.gray = 10;
  if (clear) png_set_tRNS(png, info, alpha, 2, &gray);
  png_write_info(png, info);
  const std::size_t row_bytes = png_get_rowbytes(png, info);
  std::vector<std::string> samples(static_cast<std::size_t>(height), std::string(row_bytes, 0));
  std::vector<png_bytep> rows;
  char value = 0;
  for (std::string& row : samples) {
    for (char& c : row) c = bits < 8 ? '\x1b' : value++;  // 2-bit samples 0 1 2 3
    rows.push_back(reinterpret_cast<png_bytep>(row.data()));
  }
  png_write_image(png, rows.data());
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return out;
}

TEST(ImageIo, PngsOfEveryKindBecomeWhatTheyShow) {
  for (const bool interlaced : {false, true}) {
    const cv::Mat gray = *decode_image(png_of(8, 4, 8, PNG_COLOR_TYPE_GRAY, interlaced), "gray");
    EXPECT_EQ(gray.type(), CV_8UC1);
    EXPECT_EQ(gray.at<unsigned char>(1, 2), 10);
    const cv::Mat rgb = *decode_image(png_of(8, 4, 8, PNG_COLOR_TYPE_RGB, interlaced), "rgb");
    EXPECT_EQ(rgb.at<cv::Vec3b>(0, 1), cv::Vec3b(5, 4, 3));
    const cv::Mat rgba =
        *decode_image(png_of(8, 4, 8, PNG_COLOR_TYPE_RGB_ALPHA, interlaced), "rgba");
    EXPECT_EQ(rgba.at<cv::Vec3b>(0, 1), cv::Vec3b(6, 5, 4));
    const cv::Mat deep = *decode_image(png_of(8, 4, 16, PNG_COLOR_TYPE_GRAY, interlaced), "deep");
    EXPECT_EQ(deep.type(), CV_16UC1);
    EXPECT_EQ(deep.at<std::uint16_t>(0, 1), 0x0203);
    const cv::Mat palette =
        *decode_image(png_of(8, 4, 2, PNG_COLOR_TYPE_PALETTE, interlaced), "palette");
    EXPECT_EQ(palette.at<cv::Vec3b>(3, 1), cv::Vec3b(60, 50, 40));
    const cv::Mat few = *decode_image(png_of(8, 4, 2, PNG_COLOR_TYPE_GRAY, interlaced), "few");
    EXPECT_EQ(few.at<unsigned char>(0, 3), 255);
  }
}

/// Two pixels, opaque and with `alpha`; `kind`: EXTRASAMPLES of the fourth channel.
std::string rgba_tiff(char alpha, std::uint16_t kind) {
  std::string out("II*\0\x08\0\0\0", 8);
  const auto word = [&](std::uint32_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) out += static_cast<char>(value >> 8 * i);
  };
  constexpr std::uint32_t count = 10, bits_at = 8 + 2 + 12 * count + 4, pixels_at = bits_at + 8;
  word(count, 2);
  const std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t> entries[] = {
      {256, 3, 1, 2}, {257, 3, 1, 1},         {258, 3, 4, bits_at}, {259, 3, 1, 1},
      {262, 3, 1, 2}, {273, 4, 1, pixels_at}, {277, 3, 1, 4},       {278, 3, 1, 1},
      {279, 4, 1, 8}, {338, 3, 1, kind}};
  for (const auto& [tag, type, values, value] : entries) {
    word(tag, 2);
    word(type, 2);
    word(values, 4);
    word(value, 4);
  }
  word(0, 4);
  for (int i = 0; i < 4; ++i) word(8, 2);
  return out + std::string("\x01\x02\x03\xff\x04\x05\x06", 7) + alpha;
}

TEST(ImageIo, TransparentPixelsOfTiffsAreCountedWhereTheChannelIsAlpha) {
  EXPECT_EQ(decode_image(rgba_tiff(7, 2), "rgba")->at<cv::Vec3b>(0, 1), cv::Vec3b(6, 5, 4));
  EXPECT_EQ(transparent_share(rgba_tiff(7, 2)), 0.5);
  EXPECT_EQ(transparent_share(rgba_tiff(7, 1)), 0.5);
  EXPECT_EQ(transparent_share(rgba_tiff(7, 0)), 0) << "infrared, say";
  EXPECT_EQ(transparent_share(rgba_tiff('\xff', 2)), 0);
}

TEST(ImageIo, TransparentPixelsAreCounted) {
  for (const bool interlaced : {false, true}) {
    const auto share = [&](int bits, int kind, bool clear = false) {
      return transparent_share(png_of(8, 4, bits, kind, interlaced, clear));
    };
    EXPECT_EQ(share(8, PNG_COLOR_TYPE_GRAY), 0);
    EXPECT_EQ(share(8, PNG_COLOR_TYPE_RGB_ALPHA), 1) << "alpha is 3, 7, 11 ...";
    EXPECT_EQ(share(16, PNG_COLOR_TYPE_GRAY_ALPHA), 1);
    EXPECT_EQ(share(2, PNG_COLOR_TYPE_PALETTE), 0);
    EXPECT_EQ(share(2, PNG_COLOR_TYPE_PALETTE, true), 0.25);
    EXPECT_EQ(share(8, PNG_COLOR_TYPE_GRAY, true), 1 / 32.0);
  }
  cv::Mat bgra(4, 8, CV_8UC4, cv::Scalar(1, 2, 3, 255));
  const auto encoded = [&](const char* extension) {
    std::vector<unsigned char> bytes;
    cv::imencode(extension, bgra, bytes);
    return std::string(bytes.begin(), bytes.end());
  };
  for (const char* extension : {".png", ".tiff", ".bmp", ".jpg"})
    EXPECT_EQ(transparent_share(encoded(extension)), 0) << extension;
  bgra.at<cv::Vec4b>(0, 0)[3] = 254;
  EXPECT_EQ(transparent_share(encoded(".png")), 1 / 32.0);
  EXPECT_EQ(transparent_share(encoded(".tiff")), 0) << "OpenCV's doesn't say that it is alpha";
  EXPECT_EQ(transparent_share("\x89PNG\r\n\x1A\n"), 0);
  EXPECT_EQ(transparent_share(""), 0);
}

TEST(ImageIo, DecodersPrintNothingAndErrorsNameTheFile) {
  const cv::Mat color = gradient_bgr();
  cv::Mat deep;
  color.convertTo(deep, CV_16U, 200);
  cv::extractChannel(deep, deep, 1);
  std::vector<unsigned char> bmp;
  ASSERT_TRUE(cv::imencode(".bmp", color, bmp));
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  int refused = 0;
  std::string unnamed;
  std::uint32_t state = 77;
  for (const std::string& whole : {*encode_png(color), *encode_png(deep), *encode_jpeg(color, 90),
                                   *encode_tiff(deep, "t"), std::string(bmp.begin(), bmp.end())}) {
    for (int round = 0; round < 300; ++round) {
      std::string bytes = whole;
      const auto next = [&](std::size_t below) {
        state = state * 1664525u + 1013904223u;
        return (state >> 8) % below;
      };
      // Headers half of the time, the whole file the other half; cut every fifth time.
      const std::size_t reach = round % 2 == 0 ? 60 : bytes.size();
      for (int k = 0; k < 1 + round % 3; ++k) bytes[next(reach)] = static_cast<char>(next(256));
      if (round % 5 == 0) bytes.resize(next(bytes.size()));
      const auto image = decode_image(bytes, "hurt file");
      if (image) continue;
      ++refused;
      if (image.error().where.find("hurt file") == std::string::npos) unnamed = image.error().where;
    }
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_GT(refused, 300);
  EXPECT_EQ(unnamed, "");
}

TEST(ImageIo, SixteenBitWhereEightIsExpected) {
  const TempFolder folder;
  ASSERT_TRUE(write_png(folder / "deep.png", cv::Mat(8, 8, CV_16UC1, cv::Scalar(30000))));
  const auto image = read_visible(folder / "deep.png");
  ASSERT_FALSE(image);
  EXPECT_NE(image.error().message().find("16-bit"), std::string::npos);
  ASSERT_TRUE(write_png(folder / "flat.png", cv::Mat(8, 8, CV_8UC1, cv::Scalar(3))));
  EXPECT_FALSE(read_thermal_k(folder / "flat.png"));
}

TEST(ImageIo, ThermalTiffKeepsEveryTemperature) {
  const TempFolder folder;
  cv::Mat kelvin(31, 47, CV_32FC1);
  for (int i = 0; i < 31 * 47; ++i)
    kelvin.at<float>(i / 47, i % 47) = static_cast<float>(250 + 0.07 * i);
  kelvin.at<float>(3, 5) = invalid_k;
  kelvin.at<float>(3, 6) = -4;  // no such temperature
  kelvin.at<float>(3, 7) = 1e9F;
  ASSERT_TRUE(write_thermal_tiff(folder / "t.tiff", kelvin));
  const auto back = read_thermal_k(folder / "t.tiff");
  ASSERT_TRUE(back);
  for (int y = 0; y < 31; ++y) {
    for (int x = 0; x < 47; ++x) {
      if (y == 3 && x >= 5 && x <= 7) {
        EXPECT_TRUE(std::isnan(back->at<float>(y, x)));
      } else {
        EXPECT_NEAR(back->at<float>(y, x), kelvin.at<float>(y, x), 0.00502);
      }
    }
  }
  EXPECT_TRUE(std::filesystem::exists(folder / "t.tiff.json"));
}

TEST(ImageIo, ThermalScaleComesFromTagThenSidecarThenCentikelvin) {
  const TempFolder folder;
  const cv::Mat samples(4, 4, CV_16UC1, cv::Scalar(3000));
  put(folder / "tag.tiff", *encode_tiff(samples, R"({"scale":0.04,"offset":100})"));
  EXPECT_NEAR(read_thermal_k(folder / "tag.tiff")->at<float>(0, 0), 220, 1e-4);
  put(folder / "plain.tiff", *encode_tiff(samples, ""));
  EXPECT_NEAR(read_thermal_k(folder / "plain.tiff")->at<float>(0, 0), 30, 1e-4);
  put(folder / "plain.tiff.json", R"({"scale":0.1})");
  EXPECT_NEAR(read_thermal_k(folder / "plain.tiff")->at<float>(0, 0), 300, 1e-4);
  put(folder / "plain.tiff.json", R"({"scale":)");
  EXPECT_FALSE(read_thermal_k(folder / "plain.tiff"));
  put(folder / "plain.tiff.json", R"({"scale":-1})");
  EXPECT_FALSE(read_thermal_k(folder / "plain.tiff"));
}

TEST(ImageIo, HotThermalTiffsTakeACoarserScale) {
  const TempFolder folder;
  cv::Mat kelvin(4, 4, CV_32FC1, cv::Scalar(295.5));
  kelvin.at<float>(1, 2) = 1173.15F;
  ASSERT_TRUE(write_thermal_tiff(folder / "t.tiff", kelvin));
  const auto back = read_thermal_k(folder / "t.tiff");
  ASSERT_TRUE(back);
  EXPECT_NEAR(back->at<float>(1, 2), 1173.15, 0.0101);
  EXPECT_NEAR(back->at<float>(0, 0), 295.5, 0.0101);
  EXPECT_EQ(kelvin_per_count_for(std::vector<cv::Mat>{kelvin}), 0.02);
  kelvin.at<float>(1, 2) = 655.3F;
  EXPECT_EQ(kelvin_per_count_for(std::vector<cv::Mat>{kelvin}), 0.01);
}

TEST(ImageIo, ATemperatureBelowZeroKelvinIsNone) {
  const TempFolder folder;
  put(folder / "t.tiff", *encode_tiff(cv::Mat(4, 4, CV_16UC1, cv::Scalar(20000)),
                                      R"({"scale":0.01,"offset":-273.15})"));
  EXPECT_TRUE(std::isnan(read_thermal_k(folder / "t.tiff")->at<float>(0, 0)));
  put(folder / "t.tiff",
      *encode_tiff(cv::Mat(4, 4, CV_16UC1, cv::Scalar(20000)), R"({"scale":1e300})"));
  EXPECT_FALSE(read_thermal_k(folder / "t.tiff"));
  // What other programs write into the description is none of our business.
  put(folder / "t.tiff",
      *encode_tiff(cv::Mat(4, 4, CV_16UC1, cv::Scalar(20000)), "taken in the cold"));
  EXPECT_TRUE(read_thermal_k(folder / "t.tiff"));
}

TEST(ImageIo, AJpegWithAShiftedScanIsDamaged) {
  const TempFolder folder;
  cv::Mat image(240, 320, CV_8UC3);
  cv::RNG(3).fill(image, cv::RNG::UNIFORM, 0, 255);
  const std::string whole = *encode_jpeg(image, 90);
  EXPECT_TRUE(decode_jpeg(whole, "whole"));
  int told = 0;
  for (std::size_t at = whole.size() / 4; at < whole.size() - 2000; at += whole.size() / 16) {
    std::string bytes = whole;
    for (std::size_t i = at; i < at + 64; ++i) bytes[i] = static_cast<char>(bytes[i] ^ 0x55);
    told += !decode_jpeg(bytes, "damaged");
  }
  EXPECT_GE(told, 10);  // of 11: a scan may fall into step again
  // A few bytes of padding before the end are what some cameras write.
  EXPECT_TRUE(decode_jpeg(
      whole.substr(0, whole.size() - 2) + std::string(8, '\0') + whole.substr(whole.size() - 2),
      "padded"));
}

TEST(ImageIo, FloatTiffKeepsNanAndExtremes) {
  const TempFolder folder;
  cv::Mat values(5, 7, CV_32FC1, cv::Scalar(1.5));
  values.at<float>(0, 0) = invalid_k;
  values.at<float>(0, 1) = 3.0e38F;
  values.at<float>(0, 2) = -1e-38F;
  ASSERT_TRUE(write_float_tiff(folder / "d.tiff", values));
  const auto back = read_float_tiff(folder / "d.tiff");
  ASSERT_TRUE(back);
  EXPECT_TRUE(std::isnan(back->at<float>(0, 0)));
  EXPECT_EQ(back->at<float>(0, 1), 3.0e38F);
  EXPECT_EQ(back->at<float>(0, 2), -1e-38F);
  EXPECT_EQ(back->at<float>(4, 6), 1.5F);
  EXPECT_FALSE(read_image(folder / "d.tiff"));
}

TEST(ImageIo, AnotherCountThanZeroForInvalidIsRefused) {
  for (const char* text :
       {R"({"scale":0.01})", R"({"scale":0.01,"invalid":0})", R"({"scale":0.01,"invalid":null})"})
    EXPECT_TRUE(thermal_scale_of_sidecar(text, "s.json")) << text;
  for (const char* text :
       {R"({"scale":0.01,"offset":0,"invalid":30000})", R"({"scale":0.01,"invalid":"none"})"}) {
    const auto tag = thermal_scale_of_sidecar(text, "s.json");
    ASSERT_FALSE(tag) << text;
    EXPECT_NE(tag.error().message().find("\"invalid\""), std::string::npos);
  }
}

}  // namespace
}  // namespace orbitfuse
