// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/image/image_codec.hpp"
#include "core/result.hpp"
#include "core/temperature.hpp"
#include "drivers/stills/dji_jpeg.hpp"
#include "drivers/stills/flir_jpeg.hpp"
#include "drivers/stills/import.hpp"

namespace orbitfuse {

/// One thermal file, before the session-wide decision what its samples mean.
struct ThermalFile {
  enum class Kind {
    radiometric_jpeg,
    samples16,
    gray8
  };  ///< the first: any image of a FLIR camera
  Kind kind = Kind::gray8;
  std::string bytes;  ///< gray8: the file
  std::optional<std::int64_t> taken_ns;
  cv::Mat image;  ///< samples16: CV_16UC1; gray8: CV_8U
  std::optional<FlirImage> flir;
  std::optional<DjiImage> dji;         ///< samples16: never temperatures unless the user says how
  std::optional<ThermalScaleTag> tag;  ///< from the file or its sidecar
  double transparent = 0;              ///< as of StillPhoto
  std::string other_pages;             ///< likewise; of the first page
  const char* float_unit = nullptr;    ///< samples16 that were floats: what these were taken for
};

/// Without a page the file must hold a single image.
Result<ThermalFile> read_thermal_file(const std::filesystem::path& file,
                                      std::optional<int> page = {});
/// The same of bytes that were read from `file`.
Result<ThermalFile> thermal_file(std::string_view bytes, const std::filesystem::path& file,
                                 std::optional<int> page = {});
/// Images in the bytes: pages of a TIFF, frames of a FLIR recording; at least 1.
int thermal_page_count(std::string_view bytes);

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
  void observe_samples(const ThermalFile& file, const std::string& where);
  void tell_guesses(std::vector<std::string>& list) const;
  Result<Converted> convert_samples(const ThermalFile& file, const std::string& where) const;
  Converted stretched(const cv::Mat& counts) const;
  Result<Converted> stored(const cv::Mat& counts, const std::vector<double>& kelvin,
                           const std::string& where) const;

  const ImportOptions& options_;
  int files_ = 0, radiometric_jpegs_ = 0, with_scale_ = 0;
  int samples16_ = 0;  ///< files that a scale of the user's is for
  std::map<std::string, std::vector<std::string>> floats_;  ///< files of floats, by their unit
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
