// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "core/temperature.hpp"
#include "drivers/stills/import.hpp"
#include "drivers/stills/thermal_file.hpp"

namespace orbitfuse {

/// How often each count occurs.
using CountHistogram = std::vector<std::uint64_t>;

/// The last of 65536 counts means "that or more": it is no temperature.
/// What thermal samples mean, decided once for all files, so that a session never mixes meanings:
/// first every file is observed, then each is converted. Temperatures are what a session is for, so
/// files that have none (8-bit, raw counts) are refused beside files that have them, each by name;
/// among 16-bit files without a scale the larger part says whether they are centikelvin or counts.
class ThermalDecoder {
 public:
  explicit ThermalDecoder(const ImportOptions& options) : options_(options) {}
  void observe(const ThermalFile& file, const std::string& where);

  // After all observations:
  bool samples_are_raw_counts() const;  ///< 16-bit samples without a scale
  bool has_temperatures() const;        ///< so will the session
  double kelvin_per_count() const;      ///< in which the session stores them: one for all files
  /// A session that goes on has files of this scale.
  void store_no_finer_than(double kelvin_per_count);
  int files() const { return files_; }
  int radiometric_jpegs() const { return radiometric_jpegs_; }
  /// What is worth telling of the temperatures: a coarser scale, a doubtful or guessed one, and one
  /// that was given for nothing.
  std::vector<std::string> remarks() const;

  struct Converted {
    cv::Mat counts;  ///< of temperature, 0 = invalid; empty for grey
    double kelvin_per_count = 0.01;
    int without_temperature = 0;  ///< samples that no temperature or stored count stands for
    cv::Mat gray;                 ///< raw counts under one stretch for the session
    bool keep_bytes = false;      ///< 8-bit file: copy it
    std::optional<FlirCalibration> radiometry;  ///< as converted, of a FLIR file
  };
  /// Input error when the file's samples can't be temperatures, or are of another kind than the
  /// rest.
  Result<Converted> convert(const ThermalFile& file, const std::string& where) const;

 private:
  std::optional<ThermalScaleTag> scale_of(const ThermalFile& file) const;
  void observe_jpeg(const FlirImage& image);
  void observe_floats(const ThermalFile& file, const std::string& where);
  void observe_samples(const ThermalFile& file, const std::string& where);
  void tell_guesses(std::vector<std::string>& list) const;
  double hottest_k() const;
  Result<Converted> convert_samples(const ThermalFile& file, const std::string& where) const;
  Result<Converted> convert_floats(const ThermalFile& file, const std::string& where) const;
  Converted stretched(const cv::Mat& counts) const;
  Result<Converted> stored(const cv::Mat& counts, const std::vector<double>& kelvin,
                           const std::string& where) const;

  const ImportOptions& options_;
  int files_ = 0, radiometric_jpegs_ = 0, with_scale_ = 0;
  int without_counts_ = 0;                ///< files that a scale of the user's is not for
  FloatUnits floats_;                     ///< those whose unit nothing states
  int dji_ = 0;                           ///< files of DJI drones whose counts nobody gave a scale
  std::set<std::string> dji_parameters_;  ///< what their operators set for temperatures, in words
  int like_centikelvin_ = 0, like_counts_ = 0;  ///< 16-bit files without a scale
  CountHistogram counts_ = CountHistogram(65536),
                 centikelvin_ = CountHistogram(65536);  ///< of these
  double hottest_k_ = 0, least_kelvin_per_count_ = kelvin_per_dn;
  std::vector<std::string> colored_;  ///< 8-bit files whose channels differ
  std::vector<std::string>
      glowing_;  ///< files of which one half is hotter than anything but a furnace
};

}  // namespace orbitfuse
