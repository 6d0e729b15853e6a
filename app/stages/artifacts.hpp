// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <filesystem>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/pipeline/stage.hpp"
#include "app/pipeline/stage_record.hpp"
#include "core/geometry/reconstruction.hpp"
#include "core/geometry/transform.hpp"
#include "core/json_fields.hpp"
#include "core/session/session.hpp"
#include "recon/nerf/dataset.hpp"

// What stages leave for each other, in formats that other tools read (docs/formats.md).
namespace orbitfuse::stages {

/// To read what the finished stages of a run left, outside of any run.
pipeline::StageContext context_of_run(const std::filesystem::path& out);

/// Whether the fields of a finished run and what they stand on are of one making: a stage can be
/// run again alone, or a folder be put in. Errors: input (which is older than what).
Status check_up_to_date(const std::filesystem::path& out);

/// Whether poses and fields lie there as their stages wrote them: another run's field is whole too,
/// and would be shown as this run's temperatures. Errors: input (which file).
Status check_as_written(const pipeline::StageContext& context);

/// Into the stage's folder: model/ (COLMAP, binary; names as in the session), transforms.json
/// (files as seen from it, with the names that they had before they were imported).
Status save_poses(const pipeline::StageContext& context, const Session& session,
                  const Reconstruction& model);
Result<Reconstruction> load_poses(const std::filesystem::path& folder, Modality modality);
/// Of the views as the field of this modality sees them: where training moved them, else as posed.
Result<Reconstruction> load_trained_poses(const pipeline::StageContext& context, Modality modality);

/// Why the stage that posed them doubts views, by their names; `folder` is that finished stage's.
/// Errors: input (its record is cut or of another version).
Result<std::map<std::string, std::string>> load_doubts(const std::filesystem::path& folder);

/// Which world the poses of a stage live in (poses.json). The doubtful views' names stand beside
/// it, so that what later stages make of them is made anew where only these change.
enum class PoseFrame { own, visible };
Status save_pose_frame(const std::filesystem::path& folder, PoseFrame frame,
                       const std::vector<std::string>& doubtful);
/// Errors: input (not there, cut, or without the field: the stage has to run again).
Result<PoseFrame> load_pose_frame(const std::filesystem::path& folder);

/// How the two fields relate, and what found it (registration.json).
struct RegistrationRecord {
  Similarity3d visible_from_thermal;
  std::string how;
};
Status save_registration(const std::filesystem::path& folder, const RegistrationRecord& record);
Result<RegistrationRecord> load_registration(const std::filesystem::path& folder);

/// NNN_depth.tiff, NNN_confidence.tiff, NNN_normal_{x,y,z}.tiff and depth.json with the cameras.
Status save_depth_maps(const std::filesystem::path& folder, const std::vector<DepthMap>& maps);
Result<std::vector<DepthMap>> load_depth_maps(const std::filesystem::path& folder);

/// temperature_bounds.json as ThermoNeRF reads it (degrees Celsius).
Status save_temperature_bounds(const std::filesystem::path& folder, double low_k, double high_k);

/// What training says of single frames, and how it saw them.
struct TrainedFrames {
  /// R, G, B of a frame against the common exposure; of the others it was steady.
  std::map<std::string, std::array<double, 3>> gains;
  std::map<std::string, double> offsets_k;  ///< the camera's drift in a frame; of the others none
  double shading_k = 0;  ///< nerf::shading_image(): in every frame, not in the field
  /// From a gray thermal frame's levels to the field's; empty: they are.
  std::map<std::string, nerf::GrayCurve> gray_curves;
  std::vector<std::string> heldout;  ///< that the field did not learn from
  double heldout_psnr_db = std::numeric_limits<double>::quiet_NaN();  ///< NaN: there were none
  int width_px = 0;
};
/// `folder`: of the finished training. Errors: input (its record is cut or of another version).
Result<TrainedFrames> load_trained_frames(const std::filesystem::path& folder);

/// What fusion says of its images.
struct FusedImages {
  std::vector<std::string> methods;  ///< one folder each
  double measured_share = 0;         ///< of all pixels, that have a temperature
};
/// As load_trained_frames(), of the finished fusion.
Result<FusedImages> load_fused_images(const std::filesystem::path& folder);

Status write_json(const std::filesystem::path& file, const nlohmann::json& j);
Result<nlohmann::json> read_json(const std::filesystem::path& file);
/// Fields of a file of a stage; errors name both, and say to make the file again.
JsonFields stage_fields(const nlohmann::json& j, const std::filesystem::path& file);
/// Of the metrics in a stage's record.
JsonFields metric_fields(const pipeline::StageRecord& record, const std::filesystem::path& folder);

}  // namespace orbitfuse::stages
