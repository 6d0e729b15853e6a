// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/thermal_decoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/image/has_colors.hpp"
#include "core/image/image_io.hpp"
#include "core/temperature.hpp"

namespace orbitfuse {
namespace {

/// -100 C: nothing on a field session is colder but a clear sky, and that has few pixels.
constexpr double coldest_plausible_k = 173.15;
/// 500 C: half an image that glows is a wrong scale, or a furnace.
constexpr double glowing_k = 773.15;

CountHistogram histogram_of(const cv::Mat& counts) {
  CountHistogram histogram(65536);
  for (int y = 0; y < counts.rows; ++y) {
    const auto* row = counts.ptr<std::uint16_t>(y);
    for (int x = 0; x < counts.cols; ++x) ++histogram[row[x]];
  }
  return histogram;
}

void add(const CountHistogram& from, CountHistogram& to) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i] += from[i];
}

/// Among the samples that are not 0; 65535 without any.
double percentile(const CountHistogram& histogram, double percent) {
  std::uint64_t total = 0;
  for (std::size_t dn = 1; dn < histogram.size(); ++dn) total += histogram[dn];
  if (total == 0) return 65535;
  const auto rank = static_cast<std::uint64_t>(percent / 100.0 * static_cast<double>(total - 1));
  std::uint64_t seen = 0;
  for (std::size_t dn = 1; dn < histogram.size(); ++dn) {
    seen += histogram[dn];
    if (seen > rank) return static_cast<double>(dn);
  }
  return 65535;
}

double kelvin_of(double count, ThermalScaleTag scale) { return count * scale.scale + scale.offset; }

bool is_plausible(const CountHistogram& histogram, ThermalScaleTag scale) {
  return kelvin_of(percentile(histogram, 5), scale) >= coldest_plausible_k;
}

tl::unexpected<Error> bad_floats(const std::string& where, const std::string& found) {
  return fail(
      ErrorKind::input, where, "32-bit floats" + found,
      "store kelvin or Celsius and name it in a tag or sidecar ({\"unit\": \"kelvin\"}), with "
      "NaN where there is no temperature, or 100 x kelvin as 16-bit (0 where there is none)");
}

/// Of floats with a scale.
cv::Mat kelvin_of_floats(const cv::Mat& values, ThermalScaleTag scale) {
  cv::Mat kelvin;
  values.convertTo(kelvin, CV_32F, scale.scale, scale.offset);
  return kelvin;
}

tl::unexpected<Error> too_cold(const std::string& where, double coldest_k, ThermalScaleTag scale) {
  return fail(
      ErrorKind::input, where,
      fmt::format(
          "{:g} K per count and an offset of {:g} K make {:.0f} C of its cold part ({:g} K)",
          scale.scale, scale.offset, celsius_from_kelvin(coldest_k), coldest_k),
      "kelvin = scale * count + offset: correct its tag or sidecar, or give --thermal-scale linear "
      "with --kelvin-per-count and --kelvin-offset (counts of 0.01 C need 0.01 and 273.15)");
}

constexpr const char* by_themselves =
    "import files without temperatures by themselves, or give their scale: --thermal-scale linear "
    "--kelvin-per-count K --kelvin-offset K";

/// For whoever converts the counts: nothing here does.
std::string words_of(const std::optional<DjiParameters>& set) {
  if (!set)
    return "What was set in the drone (emissivity, distance ...) is at no place that is known";
  return fmt::format(
      "Set in the drone, applied to nothing here: emissivity {:.2f}, distance {:.1f} m, humidity "
      "{:.0f} %, reflected {:.1f} C, ambient {:.1f} C",
      set->emissivity, set->distance_m, 100 * set->humidity, set->reflected_c, set->ambient_c);
}

}  // namespace

std::optional<ThermalScaleTag> ThermalDecoder::scale_of(const ThermalFile& file) const {
  const bool has_counts = file.kind != ThermalFile::Kind::floats;
  switch (options_.thermal_scale) {
    case ThermalScale::linear:
      return ThermalScaleTag{options_.kelvin_per_count, options_.kelvin_offset};
    case ThermalScale::centikelvin:
      return has_counts ? ThermalScaleTag{} : file.tag;
    case ThermalScale::raw_counts:
      return has_counts ? std::nullopt : file.tag;
    case ThermalScale::automatic:
      break;
  }
  return file.tag;
}

void ThermalDecoder::observe(const ThermalFile& file, const std::string& where) {
  ++files_;
  without_counts_ +=
      file.kind == ThermalFile::Kind::radiometric_jpeg || file.kind == ThermalFile::Kind::gray8;
  if (file.kind == ThermalFile::Kind::radiometric_jpeg) observe_jpeg(*file.flir);
  if (file.kind == ThermalFile::Kind::samples16) observe_samples(file, where);
  if (file.kind == ThermalFile::Kind::floats) observe_floats(file, where);
  if (file.kind == ThermalFile::Kind::gray8 && has_colors(file.image)) colored_.push_back(where);
}

void ThermalDecoder::observe_jpeg(const FlirImage& image) {
  ++radiometric_jpegs_;
  FlirCalibration calibration = image.calibration;
  calibration.object = with_overrides(calibration.object, options_.object);
  if (!calibration.validate("")) return;  // convert() says so
  const FlirThermometer thermometer(calibration);
  double low = 0, high = 0;
  cv::minMaxLoc(image.signal, &low, &high);
  // The hottest signals may be ones that no temperature gives.
  for (int signal = std::min(static_cast<int>(high), image.highest_signal - 1);
       signal >= static_cast<int>(low); --signal) {
    const double kelvin = thermometer.kelvin(static_cast<std::uint16_t>(signal));
    if (!std::isfinite(kelvin)) continue;
    hottest_k_ = std::max(hottest_k_, kelvin);
    break;
  }
}

void ThermalDecoder::observe_floats(const ThermalFile& file, const std::string& where) {
  const auto scale = scale_of(file);
  without_counts_ += options_.thermal_scale != ThermalScale::linear;
  const auto summary = summary_of(scale ? kelvin_of_floats(file.image, *scale) : file.image);
  if (!summary) return;  // convert() says so
  if (!scale && !file.unit) {
    floats_.observe(*summary, file.image.size(), where);
    return;
  }
  const FloatUnit unit = scale ? FloatUnit::kelvin : *file.unit;
  if (summary->cold_k(unit) < coldest_plausible_k) return;
  ++with_scale_;
  hottest_k_ = std::max(hottest_k_, summary->hottest_k[static_cast<std::size_t>(unit)]);
  if (summary->middle_k(unit) > glowing_k) glowing_.push_back(where);
}

void ThermalDecoder::observe_samples(const ThermalFile& file, const std::string& where) {
  CountHistogram histogram = histogram_of(file.image);
  histogram.back() = 0;
  const auto scale = scale_of(file);
  if (scale) {
    if (!is_plausible(histogram, *scale)) return;  // convert() says so
    ++with_scale_;
    hottest_k_ = std::max(hottest_k_, kelvin_of(percentile(histogram, 100), *scale));
    if (kelvin_of(percentile(histogram, 50), *scale) > glowing_k) glowing_.push_back(where);
  } else if (!file.dji && is_plausible(histogram, {}) &&
             options_.thermal_scale == ThermalScale::automatic) {
    ++like_centikelvin_;
    add(histogram, centikelvin_);
  } else {
    ++like_counts_;
    if (file.dji) {
      ++dji_;
      dji_parameters_.insert(words_of(file.dji->parameters));
    }
    add(histogram, counts_);
  }
}

/// What a DJI drone wrote says nothing of other files.
bool ThermalDecoder::samples_are_raw_counts() const {
  return like_counts_ - dji_ > like_centikelvin_;
}

bool ThermalDecoder::has_temperatures() const {
  return radiometric_jpegs_ + with_scale_ > 0 || floats_.hottest_k(coldest_plausible_k) > 0 ||
         (like_centikelvin_ > 0 && !samples_are_raw_counts());
}

double ThermalDecoder::hottest_k() const {
  return std::max(hottest_k_, floats_.hottest_k(coldest_plausible_k));
}

double ThermalDecoder::kelvin_per_count() const {
  return std::max(least_kelvin_per_count_, kelvin_per_count_for(hottest_k()));
}

void ThermalDecoder::store_no_finer_than(double kelvin_per_count) {
  least_kelvin_per_count_ = std::max(least_kelvin_per_count_, kelvin_per_count);
}

void ThermalDecoder::tell_guesses(std::vector<std::string>& list) const {
  for (std::string& words : floats_.told()) list.push_back(std::move(words));
  const double median_c = celsius_from_kelvin(kelvin_of(percentile(centikelvin_, 50), {}));
  if (like_centikelvin_ > 0 && !samples_are_raw_counts() && !(median_c >= -40 && median_c <= 150)) {
    list.push_back(fmt::format(
        "no scale given; 16-bit samples are read as centikelvin: median {:.0f} C. If that can't "
        "be, "
        "give --thermal-scale linear with --kelvin-per-count and --kelvin-offset, or raw",
        median_c));
  }
  if (options_.thermal_scale != ThermalScale::automatic && without_counts_ > 0) {
    const bool is_linear = options_.thermal_scale == ThermalScale::linear;
    list.push_back(fmt::format(
        "--thermal-scale{} is for 16-bit samples{} and changes nothing in {} of {} thermal files "
        "(8-bit, {}or radiometric JPEG)",
        is_linear ? " linear" : "", is_linear ? " and 32-bit floats" : "", without_counts_, files_,
        is_linear ? "" : "32-bit float "));
  }
}

std::vector<std::string> ThermalDecoder::remarks() const {
  std::vector<std::string> list;
  tell_guesses(list);
  if (kelvin_per_count() > kelvin_per_dn) {
    list.push_back(fmt::format(
        "the hottest sample is {:.0f} C, so thermal files hold {:g} K a count, not {:g}; their "
        "tag says so",
        celsius_from_kelvin(hottest_k()), kelvin_per_count(), kelvin_per_dn));
  }
  if (dji_ > 0) {
    list.push_back(fmt::format(
        "{} thermal files of DJI drones hold counts; how they become temperatures is not "
        "published: "
        "export temperatures with DJI's own program, or give a scale (--thermal-scale linear). "
        "{}{}",
        dji_, *dji_parameters_.begin(),
        dji_parameters_.size() > 1
            ? fmt::format(" (and {} other settings)", dji_parameters_.size() - 1)
            : ""));
  }
  // Beside files with temperatures convert() refuses them.
  if (!colored_.empty() && !has_temperatures()) {
    list.push_back(fmt::format(
        "{}{}: in colour, so a palette's picture or a photograph: its colours are no temperatures, "
        "only its brightness is used; import the camera's radiometric files (or, if it is a photo, "
        "give it with --visible)",
        colored_.front(),
        colored_.size() == 1 ? ""
                             : fmt::format(" and {} more thermal files", colored_.size() - 1)));
  }
  std::vector<std::string> glowing = glowing_;
  for (std::string& file : floats_.hotter_than(glowing_k)) glowing.push_back(std::move(file));
  if (!glowing.empty()) {
    list.push_back(fmt::format(
        "half of {} ({} such files) is hotter than 500 C: if it is no furnace, its scale is wrong "
        "(--thermal-scale centikelvin, or linear with --kelvin-per-count)",
        glowing.front(), glowing.size()));
  }
  return list;
}

Result<ThermalDecoder::Converted> ThermalDecoder::convert(const ThermalFile& file,
                                                          const std::string& where) const {
  if (file.kind == ThermalFile::Kind::gray8) {
    if (has_temperatures()) {
      return fail(ErrorKind::input, where,
                  "8-bit without temperatures, among thermal files that have them",
                  "import it by itself, or with --visible if it is a photo");
    }
    Converted out;
    out.keep_bytes = true;
    return out;
  }
  if (file.kind == ThermalFile::Kind::samples16) return convert_samples(file, where);
  if (file.kind == ThermalFile::Kind::floats) return convert_floats(file, where);
  FlirCalibration calibration = file.flir->calibration;
  calibration.object = with_overrides(calibration.object, options_.object);
  ORBITFUSE_TRY(calibration.validate(where));
  std::vector<double> kelvin = kelvin_table(calibration);
  const auto end = [&](int signal) { return kelvin.begin() + signal; };
  std::fill(kelvin.begin(), end(file.flir->lowest_signal + 1), std::nan(""));
  std::fill(end(file.flir->highest_signal), kelvin.end(), std::nan(""));
  ORBITFUSE_ASSIGN(Converted out, stored(file.flir->signal, kelvin, where));
  out.radiometry = calibration;
  return out;
}

Result<ThermalDecoder::Converted> ThermalDecoder::convert_samples(const ThermalFile& file,
                                                                  const std::string& where) const {
  std::optional<ThermalScaleTag> scale = scale_of(file);
  const CountHistogram histogram = histogram_of(file.image);
  if (scale && !is_plausible(histogram, *scale))
    return too_cold(where, kelvin_of(percentile(histogram, 5), *scale), *scale);
  if (!scale && !has_temperatures()) return stretched(file.image);
  if (!scale && (file.dji || samples_are_raw_counts() || !is_plausible(histogram, {}))) {
    return fail(ErrorKind::input, where,
                "16-bit counts without a known scale, among thermal files with temperatures",
                by_themselves);
  }
  const ThermalScaleTag tag = scale.value_or(ThermalScaleTag{});
  std::vector<double> kelvin(65536, std::nan(""));
  for (std::size_t dn = 1; dn + 1 < kelvin.size(); ++dn)
    kelvin[dn] = kelvin_of(static_cast<double>(dn), tag);
  return stored(file.image, kelvin, where);
}

Result<ThermalDecoder::Converted> ThermalDecoder::convert_floats(const ThermalFile& file,
                                                                 const std::string& where) const {
  const auto scale = scale_of(file);
  const bool is_guess = !scale && !file.unit;
  const FloatUnit unit = scale      ? FloatUnit::kelvin
                         : is_guess ? floats_.unit_of(file.image.size())
                                    : *file.unit;
  const cv::Mat values = scale ? kelvin_of_floats(file.image, *scale) : file.image;
  const auto summary = summary_of(values);
  if (!summary) return bad_floats(where, " without one temperature");
  if (is_guess && !is_kelvin_or_celsius(*summary))
    return bad_floats(
        where, fmt::format(" with a median of {:g}: neither kelvin nor Celsius", summary->middle));
  const double coldest_k = summary->cold_k(unit);
  if (coldest_k < coldest_plausible_k && scale) return too_cold(where, coldest_k, *scale);
  if (coldest_k < coldest_plausible_k)
    return bad_floats(where, fmt::format(", read as {}: their cold part would be {:.0f} C",
                                         name(unit), celsius_from_kelvin(coldest_k)));
  const cv::Mat kelvin = kelvin_of_floats(values, unit);
  Converted out;
  out.kelvin_per_count = kelvin_per_count();
  out.counts = counts_of_kelvin(kelvin, out.kelvin_per_count);
  // NaN, infinity and what is below 0 K were no samples before either.
  cv::Mat numbers;
  cv::inRange(kelvin, std::numeric_limits<float>::min(), std::numeric_limits<float>::max(),
              numbers);
  out.without_temperature = cv::countNonZero(numbers & (out.counts == 0));
  if (cv::countNonZero(out.counts) == 0)
    return bad_floats(where, " without a temperature that can be stored");
  return out;
}

ThermalDecoder::Converted ThermalDecoder::stretched(const cv::Mat& counts) const {
  CountHistogram all = counts_;
  add(centikelvin_, all);
  const double low = percentile(all, 0.1), high = std::max(percentile(all, 99.9), low + 1);
  Converted out;
  counts.convertTo(out.gray, CV_8U, 255.0 / (high - low), -255.0 * low / (high - low));
  return out;
}

Result<ThermalDecoder::Converted> ThermalDecoder::stored(const cv::Mat& counts,
                                                         const std::vector<double>& kelvin,
                                                         const std::string& where) const {
  Converted out;
  out.kelvin_per_count = kelvin_per_count();
  std::vector<std::uint16_t> table(kelvin.size());
  std::transform(kelvin.begin(), kelvin.end(), table.begin(),
                 [&](double t) { return count_from_kelvin(t, out.kelvin_per_count); });
  out.counts.create(counts.size(), CV_16UC1);
  std::transform(counts.begin<std::uint16_t>(), counts.end<std::uint16_t>(),
                 out.counts.begin<std::uint16_t>(), [&](std::uint16_t dn) { return table[dn]; });
  if (cv::countNonZero(out.counts) == 0) {
    return fail(ErrorKind::input, where, "not one sample has a temperature that can be stored",
                "an empty frame? Leave it out");
  }
  // 0 was no sample before either.
  cv::Mat lost = (out.counts == 0) & (counts != 0);
  out.without_temperature = cv::countNonZero(lost);
  return out;
}

}  // namespace orbitfuse
