// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/radiometry/flir_temperature.hpp"

// Files of cameras and programs that are not at hand, written as their formats are documented: for
// tests and as seeds of the fuzzers.
namespace orbitfuse::made {

/// Calibration of a common uncooled camera: 295 K at about 14,000 counts.
FlirCalibration flir_calibration();
/// The signal at which that camera shows the temperature.
std::uint16_t flir_signal(double kelvin, const FlirCalibration& calibration);

enum class FlirPixels { raw, png, jpeg_ls };
/// What the camera record says its calibration reaches over.
struct SignalRange {
  int lowest = 1, highest = 65535;
};
/// A FLIR radiometric JPEG: raw thermal record (CV_16UC1), camera record, and an embedded photo
/// unless empty, in APP1 segments of at most `segment_bytes`.
std::string flir_jpeg(const cv::Mat& signal, const FlirCalibration& calibration,
                      FlirPixels pixels = FlirPixels::raw, const std::string& embedded_photo = {},
                      std::size_t segment_bytes = 60000, SignalRange range = {});

/// The FFF file inside it; several in a row are a recording.
std::string flir_file(const cv::Mat& signal, const FlirCalibration& calibration, FlirPixels pixels,
                      const std::string& embedded_photo, SignalRange range = {});

/// A thermal JPEG of a DJI drone: counts of a known size in APP3, parameters in APP4 as newer ones
/// have them, DJI as maker.
std::string dji_jpeg(const cv::Mat& counts, bool with_parameters = true);

/// A HEIC photo of CV_8UC3, or of CV_8UC4 with alpha, that is shown turned as EXIF's `orientation`
/// says, by the file's own rotation and mirroring; `exif`: a TIFF block, or empty. Empty when this
/// machine has no encoder.
std::string heic(const cv::Mat& image, int orientation = 1, const std::string& exif = {});
/// The TIFF block of an EXIF: orientation, time 2024-05-06 07:08:09, 4.3 mm, 26 mm at 35 mm.
std::string exif_block(int orientation);

/// What a TIFF says beside its samples.
struct TiffWords {
  std::string description;
  std::string gdal_metadata;          ///< tag 42112
  int photometric = 1, channels = 1;  ///< of several channels the page is that much wider
  int planar = 1;
  int orientation = 0;           ///< tag 274; 0: none
  int orientation_of_first = 0;  ///< likewise, of the first page alone; 0: as the others
  int subfile_of_first = 0;      ///< 1: the first page is a reduced copy of another
};
/// An uncompressed little-endian TIFF of several CV_16UC1 or CV_8UC1 pages.
std::string tiff_of_pages(const std::vector<cv::Mat>& pages, const TiffWords& words);
std::string tiff_of_pages(const std::vector<cv::Mat>& pages, const std::string& description = {});

}  // namespace orbitfuse::made
