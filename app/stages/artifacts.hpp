// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/pipeline/stage.hpp"
#include "core/geometry/reconstruction.hpp"
#include "core/geometry/transform.hpp"
#include "core/session/session.hpp"

// What stages leave for each other, in formats that other tools read (docs/formats.md).
namespace orbitfuse::stages {

/// To read what the finished stages of a run left, outside of any run.
pipeline::StageContext context_of_run(const std::filesystem::path& out);

/// model/ (COLMAP, binary), transforms.json.
Status save_poses(const std::filesystem::path& folder, const Reconstruction& model);
Result<Reconstruction> load_poses(const std::filesystem::path& folder, Modality modality);
/// Of the views as the field of this modality sees them: where training moved them, else as posed.
Result<Reconstruction> load_trained_poses(const pipeline::StageContext& context, Modality modality);

/// Why the stage that posed them doubts views, by their names; `folder` is that finished stage's.
/// Errors: input (its record is cut or of another version).
Result<std::map<std::string, std::string>> load_doubts(const std::filesystem::path& folder);

/// Which world the poses of a stage live in (poses.json).
enum class PoseFrame { own, visible };
Status save_pose_frame(const std::filesystem::path& folder, PoseFrame frame);
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

nlohmann::json to_json(const Similarity3d& a_from_b);

Status write_json(const std::filesystem::path& file, const nlohmann::json& j);
Result<nlohmann::json> read_json(const std::filesystem::path& file);

}  // namespace orbitfuse::stages
