// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.hpp"
#include "core/radiometry/flir_temperature.hpp"
#include "core/result.hpp"
#include "core/session/session.hpp"
#include "drivers/stills/video_frames.hpp"

// Makes a session from files that other cameras and tools left. docs/formats.md lists the sources.
namespace orbitfuse {

/// How thermal samples become temperatures.
enum class ThermalScale {
  automatic,    ///< radiometric JPEG; the TIFF's own tag or sidecar; else centikelvin if plausible,
                ///< else raw counts; 8-bit images are grey
  centikelvin,  ///< T[K] = 0.01 DN
  linear,       ///< T[K] = kelvin_per_count DN + kelvin_offset
  raw_counts,   ///< 16-bit without a known scale: kept as grey intensities, never as temperatures
};

/// The user's word that the frames, in capture order, were taken at nominal stations.
/// Azimuths then start at 0 in each modality: where each orbit began is unknown.
struct DeclaredStations {
  double spacing_deg = 30;
  int loops = 1;
  std::vector<double> elevations_deg;  ///< one per loop; empty = unknown
  double elevation_sigma_deg = 5;      ///< of the elevations given
};

struct ImportOptions {
  /// Folders or files; of videos (visible) some frames are taken. A folder is read without its
  /// sub-folders, sorted by time, then name.
  std::vector<std::filesystem::path> visible, thermal;
  /// Thermal (or visible) frames recorded between stations; stored with tracking = true.
  std::vector<std::filesystem::path> visible_tracking, thermal_tracking;

  /// Radiometric JPEGs given as `thermal` also bring their embedded photo as a visible frame.
  bool embedded_visible = false;
  /// The user's word that images of equal name or time were shot at once by cameras fixed to each
  /// other, also where stations are declared; noted in the session for the pose stage.
  bool rig = false;

  /// Known poses and intrinsics; at most one per modality. The images named there are matched
  /// with the frames by file name; with no `visible` given, transforms.json lists the images too.
  std::optional<std::filesystem::path> transforms_json;
  std::optional<std::filesystem::path> visible_colmap, thermal_colmap;
  /// A ground_truth.json, as beside replay_data/car: K and c2w of both modalities
  /// (docs/formats.md).
  std::optional<std::filesystem::path> ground_truth;
  /// From `ground_truth`: take only what an operator would know: the focal length as a prior to
  /// 3 % and the loops' elevations; never the poses.
  bool ground_truth_priors_only = false;

  std::optional<DeclaredStations> visible_stations, thermal_stations;

  ThermalScale thermal_scale = ThermalScale::automatic;
  double kelvin_per_count = 0;  ///< for ThermalScale::linear, which needs it
  double kelvin_offset = 0;
  ObjectParameterOverrides object;

  VideoOptions video;  ///< which frames of videos are taken

  /// Focal length priors in pixels where the files have none.
  std::optional<double> visible_focal_px, thermal_focal_px;

  Status validate() const;
};

struct ImportReport {
  Session session;  ///< as opened again from disk
  int visible = 0, thermal = 0, tracking = 0;
  int with_pose = 0, with_station = 0;
  bool has_temperatures = false;
  double kelvin_per_count = 0.01;  ///< in which temperatures are stored
  /// Files passed over and why, priors missing ...: what is said of more than three files is one
  /// sentence with their number and the first names.
  std::vector<std::string> warnings;
  std::vector<std::string> notes;  ///< what a run will have to assume, and how to tell it
};

/// Imports into a new session folder (which must not exist or be empty). Photos are copied byte
/// for byte; thermal images become 16-bit TIFF of one scale for the session, centikelvin unless the
/// scene is too hot for it (or stay 8-bit grey). A file that can't be read, a copy of another and a
/// thermal file without temperatures among files that have them is left out with a warning; the
/// import fails only when nothing of a modality that was given is left, or not one of the poses
/// given can be used, and then, or when it is cancelled, leaves nothing behind. What an import that
/// was killed left in the folder is replaced. Errors: usage (options, file or folder given twice),
/// input (nothing readable, session folder not empty, poses that can't be used), device (disk),
/// cancelled; each names the file or field.
Result<ImportReport> import_session(const ImportOptions& options,
                                    const std::filesystem::path& session_folder,
                                    const Progress& progress = {});

/// What import_session() would do and say, without leaving anything behind: every file is read and
/// decoded, so that it takes about as long. The report's session is empty. Errors: the same.
Result<ImportReport> rehearse_import(const ImportOptions& options,
                                     const std::filesystem::path& session_folder,
                                     const Progress& progress = {});

}  // namespace orbitfuse
