// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/thermal_decoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/system/file_io.hpp"
#include "core/temperature.hpp"

namespace orbitfuse {
namespace {

/// -100 C: nothing on a field session is colder but a clear sky, and that has few pixels.
constexpr double coldest_plausible_dn = 17315;

cv::Mat centikelvin_of_linear(const cv::Mat& samples, double scale, double offset) {
  cv::Mat out(samples.size(), CV_16UC1);
  std::transform(samples.begin<std::uint16_t>(), samples.end<std::uint16_t>(), out.begin<std::uint16_t>(),
                 [&](std::uint16_t dn) {
                   return dn == 0 ? std::uint16_t{0} : centikelvin_from_kelvin(static_cast<float>(dn * scale + offset));
                 });
  return out;
}

ObjectParameters with_overrides(ObjectParameters o, const ObjectParameterOverrides& over) {
  o.emissivity = over.emissivity.value_or(o.emissivity);
  o.distance_m = over.distance_m.value_or(o.distance_m);
  o.reflected_k = over.reflected_temperature_k.value_or(o.reflected_k);
  o.atmospheric_k = over.atmospheric_temperature_k.value_or(o.atmospheric_k);
  o.relative_humidity = over.relative_humidity.value_or(o.relative_humidity);
  return o;
}

}  // namespace

Result<ThermalFile> read_thermal_file(const std::filesystem::path& path) {
  ThermalFile file;
  ORBITFUSE_ASSIGN(file.bytes, read_file(path));
  const std::string where = path.string();
  if (is_flir_jpeg(file.bytes)) {
    file.kind = ThermalFile::Kind::radiometric_jpeg;
    ORBITFUSE_ASSIGN(file.flir, read_flir_jpeg(file.bytes, where));
    return file;
  }
  std::string description;
  if (image_format(file.bytes) == ImageFormat::tiff) {
    ORBITFUSE_ASSIGN(file.image, decode_tiff(file.bytes, where, &description));
  } else {
    ORBITFUSE_ASSIGN(file.image, decode_image(file.bytes, where));
  }
  if (file.image.depth() == CV_8U) return file;
  if (file.image.type() != CV_16UC1) {
    return fail(ErrorKind::input, where,
                fmt::format("{} channels of {} bits", file.image.channels(), 8 * file.image.elemSize1()),
                "thermal images are 16-bit grey, 8-bit or FLIR radiometric JPEGs");
  }
  file.kind = ThermalFile::Kind::samples16;
  file.tag = thermal_scale_of_json(description);
  const std::filesystem::path sidecar = where + ".json";
  std::error_code ignored;
  if (!file.tag && std::filesystem::exists(sidecar, ignored)) {
    ORBITFUSE_ASSIGN(const std::string text, read_file(sidecar));
    file.tag = thermal_scale_of_json(text);
  }
  return file;
}

void ThermalDecoder::observe(const ThermalFile& file) {
  const bool tag_counts = file.tag && options_.thermal_scale != ThermalScale::raw_counts;
  if (file.kind != ThermalFile::Kind::samples16 || tag_counts) return;
  ++untagged_;
  for (int y = 0; y < file.image.rows; ++y) {
    const auto* row = file.image.ptr<std::uint16_t>(y);
    for (int x = 0; x < file.image.cols; ++x) ++histogram_[row[x]];
  }
}

double ThermalDecoder::percentile(double percent) const {
  std::uint64_t total = 0;
  for (std::size_t dn = 1; dn < histogram_.size(); ++dn) total += histogram_[dn];
  const auto rank = static_cast<std::uint64_t>(percent / 100.0 * static_cast<double>(total));
  std::uint64_t seen = 0;
  for (std::size_t dn = 1; dn < histogram_.size(); ++dn) {
    seen += histogram_[dn];
    if (seen > rank) return static_cast<double>(dn);
  }
  return 65535;
}

bool ThermalDecoder::samples_are_raw_counts() const {
  if (options_.thermal_scale == ThermalScale::raw_counts) return true;
  return options_.thermal_scale == ThermalScale::automatic && untagged_ > 0 && percentile(5) < coldest_plausible_dn;
}

Result<ThermalDecoder::Converted> ThermalDecoder::convert(const ThermalFile& file, const std::string& where) const {
  Converted out;
  if (file.kind == ThermalFile::Kind::gray8) {
    out.keep_bytes = true;
    return out;
  }
  if (file.kind == ThermalFile::Kind::radiometric_jpeg) {
    FlirImage flir = *file.flir;
    flir.calibration.object = with_overrides(flir.calibration.object, options_.object);
    ORBITFUSE_TRY(flir.calibration.validate(where));
    out.centikelvin = centikelvin_of(flir);
    return out;
  }
  if (options_.thermal_scale == ThermalScale::raw_counts || (!file.tag && samples_are_raw_counts())) {
    const double low = percentile(0.1), high = std::max(percentile(99.9), low + 1);
    file.image.convertTo(out.gray, CV_8U, 255.0 / (high - low), -255.0 * low / (high - low));
    return out;
  }
  ThermalScaleTag tag = file.tag.value_or(ThermalScaleTag{});
  if (options_.thermal_scale == ThermalScale::linear) tag = {options_.kelvin_per_count, options_.kelvin_offset};
  if (options_.thermal_scale == ThermalScale::centikelvin) tag = {};
  out.centikelvin = centikelvin_of_linear(file.image, tag.scale, tag.offset);
  return out;
}

}  // namespace orbitfuse
