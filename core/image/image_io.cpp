// SPDX-License-Identifier: BSD-3-Clause
#include "core/image/image_io.hpp"

#include <fmt/format.h>

#include <opencv2/imgproc.hpp>

#include "core/image/exif.hpp"
#include "core/image/image_codec.hpp"
#include "core/image/thermal_counts.hpp"
#include "core/system/file_io.hpp"
#include "core/temperature.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;

fs::path sidecar_of(const fs::path& path) { return path.string() + ".json"; }

Status write_encoded(const fs::path& path, const Result<std::string>& bytes) {
  if (!bytes) return tl::unexpected(bytes.error());
  return write_file_atomic(path, *bytes);
}

}  // namespace

Result<cv::Mat> read_visible(const fs::path& path) {
  ORBITFUSE_ASSIGN(const std::string bytes, read_file(path, max_image_bytes));
  ORBITFUSE_ASSIGN(cv::Mat image, decode_image(bytes, path.string()));
  if (image.depth() != CV_8U) {
    return fail(ErrorKind::input, path.string(), "16-bit samples, 8-bit expected",
                "a thermal image? Give it as thermal, or convert it to 8-bit");
  }
  if (image.channels() == 1) cv::cvtColor(image, image, cv::COLOR_GRAY2BGR);
  return apply_orientation(image, read_exif(bytes).orientation);
}

Result<ThermalCounts> read_thermal_counts(const fs::path& path) {
  ORBITFUSE_ASSIGN(const std::string bytes, read_file(path, max_image_bytes));
  std::string description;
  ThermalCounts out;
  if (image_format(bytes) == ImageFormat::tiff) {
    ORBITFUSE_ASSIGN(out.image, decode_tiff(bytes, path.string(), &description));
  } else {
    ORBITFUSE_ASSIGN(out.image, decode_image(bytes, path.string()));
  }
  if (out.image.type() != CV_16UC1) {
    return fail(ErrorKind::input, path.string(),
                fmt::format("{}-bit samples in {} channels, 16-bit grey expected",
                            8 * out.image.elemSize1(), out.image.channels()),
                "this is no radiometric image: give a 16-bit TIFF or PNG");
  }
  ORBITFUSE_ASSIGN(std::optional<ThermalScaleTag> tag,
                   thermal_scale_of_description(description, path.string()));
  std::error_code ignored;
  if (!tag && fs::exists(sidecar_of(path), ignored)) {
    ORBITFUSE_ASSIGN(const std::string sidecar, read_file(sidecar_of(path), max_settings_bytes));
    ORBITFUSE_ASSIGN(tag, thermal_scale_of_sidecar(sidecar, sidecar_of(path).string()));
  }
  out.scale = tag.value_or(ThermalScaleTag{});
  return out;
}

cv::Mat kelvin_of_counts(const ThermalCounts& counts) {
  const auto& [image, scale] = counts;
  cv::Mat kelvin(image.size(), CV_32FC1);
  for (int y = 0; y < image.rows; ++y) {
    const auto* from = image.ptr<std::uint16_t>(y);
    auto* to = kelvin.ptr<float>(y);
    for (int x = 0; x < image.cols; ++x) {
      const double t = from[x] * scale.scale + scale.offset;
      to[x] = from[x] == 0 || !(t > 0) ? invalid_k : static_cast<float>(t);  // nothing is below 0 K
    }
  }
  return kelvin;
}

Result<cv::Mat> read_thermal_k(const fs::path& path) {
  ORBITFUSE_ASSIGN(const ThermalCounts counts, read_thermal_counts(path));
  return kelvin_of_counts(counts);
}

Result<cv::Mat> read_image(const fs::path& path) {
  ORBITFUSE_ASSIGN(const std::string bytes, read_file(path, max_image_bytes));
  return decode_image(bytes, path.string());
}

Status write_png(const fs::path& path, const cv::Mat& image) {
  return write_encoded(path, encode_png(image));
}

Status write_jpeg(const fs::path& path, const cv::Mat& image, int quality) {
  return write_encoded(path, encode_jpeg(image, quality));
}

double kelvin_per_count_for(const std::vector<cv::Mat>& kelvin_images) {
  double hottest_k = 0;
  for (const cv::Mat& image : kelvin_images) {
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        const double t = image.at<float>(y, x);
        // What no scale holds decides nothing: it is not stored in any case.
        if (t > hottest_k && t <= 65535 * stored_kelvin_per_count.back()) hottest_k = t;
      }
    }
  }
  return kelvin_per_count_for(hottest_k);
}

cv::Mat counts_of_kelvin(const cv::Mat& kelvin, double kelvin_per_count) {
  CV_Assert(kelvin.type() == CV_32FC1);
  cv::Mat counts(kelvin.size(), CV_16UC1);
  for (int y = 0; y < kelvin.rows; ++y) {
    for (int x = 0; x < kelvin.cols; ++x) {
      counts.at<std::uint16_t>(y, x) =
          count_from_kelvin(static_cast<double>(kelvin.at<float>(y, x)), kelvin_per_count);
    }
  }
  return counts;
}

Status write_thermal_tiff(const fs::path& path, const cv::Mat& kelvin,
                          std::optional<double> kelvin_per_count) {
  CV_Assert(kelvin.type() == CV_32FC1);
  const double scale =
      kelvin_per_count ? *kelvin_per_count : kelvin_per_count_for(std::vector<cv::Mat>{kelvin});
  ORBITFUSE_TRY(
      write_encoded(path, encode_thermal_tiff(counts_of_kelvin(kelvin, scale), {scale, 0})));
  return write_file_atomic(sidecar_of(path), thermal_sidecar_json({scale, 0}) + "\n");
}

Status write_float_tiff(const fs::path& path, const cv::Mat& values) {
  CV_Assert(values.type() == CV_32FC1);
  return write_encoded(path, encode_tiff(values, ""));
}

Result<cv::Mat> read_float_tiff(const fs::path& path) {
  ORBITFUSE_ASSIGN(const std::string bytes, read_file(path, max_image_bytes));
  ORBITFUSE_ASSIGN(cv::Mat image, decode_tiff(bytes, path.string()));
  if (image.type() != CV_32FC1) {
    return fail(ErrorKind::input, path.string(), "not a 32-bit float TIFF",
                "write the depth map again");
  }
  return image;
}

}  // namespace orbitfuse
