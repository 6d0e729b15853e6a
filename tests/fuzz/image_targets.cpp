// SPDX-License-Identifier: BSD-3-Clause
#include <opencv2/core.hpp>

#include "core/image/exif.hpp"
#include "core/image/image_codec.hpp"
#include "drivers/stills/flir_jpeg.hpp"
#include "drivers/stills/still_photo.hpp"
#include "drivers/stills/thermal_decoder.hpp"
#include "tests/fuzz/targets.hpp"
#include "tests/support/made_files.hpp"

namespace orbitfuse::fuzz {
namespace {

/// As import does it: every page observed, then converted.
void import_thermal(std::string_view bytes) {
  const ImportOptions options;
  ThermalDecoder decoder(options);
  const int pages = std::min(thermal_page_count(bytes), 8);
  for (int page = 0; page < pages; ++page) {
    const auto file = thermal_file(bytes, "/nowhere/fuzz", page);
    if (!file) continue;
    decoder.observe(*file, "fuzz");
    static_cast<void>(thermal_still(*file, decoder, "fuzz"));
  }
}

void rjpeg(std::string_view bytes) {
  static_cast<void>(is_flir_jpeg(bytes));
  static_cast<void>(read_flir_jpeg(bytes, "fuzz"));
  import_thermal(bytes);
}

void tiff(std::string_view bytes) {
  std::string description;
  static_cast<void>(decode_tiff(bytes, "fuzz", &description));
  import_thermal(bytes);
}

void photo(std::string_view bytes) {
  static_cast<void>(name_of_other_format(bytes));
  static_cast<void>(visible_still(std::string(bytes), "fuzz"));
}

void heic(std::string_view bytes) {
  static_cast<void>(exif_of_photo(bytes));
  static_cast<void>(visible_still(std::string(bytes), "fuzz"));
}

void exif(std::string_view bytes) { static_cast<void>(read_exif(bytes)); }

void sidecar(std::string_view bytes) {
  static_cast<void>(thermal_scale_of_sidecar(bytes, "fuzz"));
  static_cast<void>(thermal_scale_of_description(bytes, "fuzz"));
}

cv::Mat counts() {
  cv::Mat image(12, 16, CV_16UC1);
  for (int i = 0; i < 192; ++i)
    image.at<std::uint16_t>(i / 16, i % 16) = static_cast<std::uint16_t>(29000 + 13 * i);
  return image;
}

cv::Mat color() {
  cv::Mat image(12, 16, CV_8UC3);
  for (int i = 0; i < 192; ++i)
    image.at<cv::Vec3b>(i / 16, i % 16) =
        cv::Vec3b(static_cast<uchar>(i), static_cast<uchar>(3 * i), 90);
  return image;
}

/// An APP1 segment with orientation, time and focal length, before a JPEG's own segments.
std::string jpeg_with_exif() {
  const std::string jpeg = *encode_jpeg(color(), 80);
  const std::string payload = std::string("Exif\0\0", 6) + made::exif_block(6);
  std::string segment("\xff\xe1", 2);
  segment += static_cast<char>((payload.size() + 2) >> 8);
  segment += static_cast<char>((payload.size() + 2) & 0xff);
  return jpeg.substr(0, 2) + segment + payload + jpeg.substr(2);
}

std::vector<std::string> rjpeg_seeds() {
  const FlirCalibration camera = made::flir_calibration();
  cv::Mat signal = counts() / 2;
  return {made::flir_jpeg(signal, camera),
          made::flir_jpeg(signal, camera, made::FlirPixels::png),
          made::flir_jpeg(signal, camera, made::FlirPixels::raw, *encode_jpeg(color(), 70), 700),
          made::flir_jpeg(signal, camera, made::FlirPixels::jpeg_ls),
          made::dji_jpeg(cv::Mat(120, 160, CV_16UC1, cv::Scalar(18500))),
          made::flir_file(signal, camera, made::FlirPixels::jpeg_ls, {}) +
              made::flir_file(signal, camera, made::FlirPixels::raw, {})};
}

std::vector<std::string> tiff_seeds() {
  cv::Mat depth(12, 16, CV_32FC1, cv::Scalar(2.5)), gray(12, 16, CV_8UC1, cv::Scalar(7));
  return {*encode_thermal_tiff(counts()), *encode_thermal_tiff(counts(), {0.04, 10}),
          *encode_tiff(depth, ""),
          made::tiff_of_pages({counts(), counts()}, R"({"scale":0.01,"offset":0})"),
          made::tiff_of_pages({gray})};
}

std::vector<std::string> photo_seeds() {
  cv::Mat gray;
  cv::extractChannel(color(), gray, 0);
  return {*encode_jpeg(color(), 90), *encode_jpeg(gray, 60), *encode_png(color()),
          *encode_png(counts()), jpeg_with_exif()};
}

/// Without an encoder on this machine one that is cut after its brand.
std::vector<std::string> heic_seeds() {
  std::vector<std::string> seeds{
      std::string("\0\0\0\x18"
                  "ftypheic\0\0\0\0mif1heic",
                  24)};
  for (const int orientation : {1, 6}) {
    std::string photo = made::heic(color(), orientation, made::exif_block(orientation));
    if (!photo.empty()) seeds.push_back(std::move(photo));
  }
  return seeds;
}

std::vector<std::string> exif_seeds() { return {jpeg_with_exif()}; }

std::vector<std::string> sidecar_seeds() {
  return {thermal_sidecar_json(), R"({"scale":0.04,"offset":-273.15})", R"({"scale":1e300})",
          R"({"scale":"x"})"};
}

}  // namespace

const std::vector<Target>& image_targets() {
  static const std::vector<Target> list{
      {"rjpeg", rjpeg, rjpeg_seeds}, {"tiff", tiff, tiff_seeds},
      {"photo", photo, photo_seeds}, {"heic", heic, heic_seeds},
      {"exif", exif, exif_seeds},    {"sidecar", sidecar, sidecar_seeds}};
  return list;
}

}  // namespace orbitfuse::fuzz
