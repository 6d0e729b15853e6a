// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "app/pipeline/stage.hpp"
#include "core/geometry/transform.hpp"
#include "core/session/session.hpp"
#include "recon/measurement/thermal_scene.hpp"

namespace orbitfuse::stages {

/// Input error where the session's frames of a modality are not those of the run: poses of one
/// session's frames tell nothing of another's, even where the files are called alike. Every file of
/// the modality is read.
Status check_session_of_run(const pipeline::StageContext& context, const Session& session,
                            Modality modality);

/// Whether a run's world is that of its visible poses, thermal ones being registered with them.
/// Where it isn't, the world is that of the poses that the run has.
bool is_in_visible_world(const pipeline::StageContext& context);
/// Takes thermal poses and the thermal field into the run's world.
Result<Similarity3d> load_world_from_thermal(const pipeline::StageContext& context);

/// What a finished run measures from: its thermal field, every posed thermal frame of the session
/// with its doubts and radiometry, and as named views the frames of both orbits ("thermal/...",
/// "visible/...": their files in the session) and the rendered ones ("000", ...), all in the
/// visible world (the thermal one, where nothing visible is posed). Small: images and depth maps
/// come when they are asked for.
/// Errors: input (no thermal field, no poses, a session of gray levels or not the run's; each says
/// what to do).
Result<measurement::ThermalScene> load_measurement_scene(
    const std::filesystem::path& out, const Session& session,
    const measurement::MeasurementOptions& options = {});

/// ThermalScene::identity of a run, of its records alone. Errors: input (a damaged record).
Result<std::string> measurement_identity(const std::filesystem::path& out, const Session& session);

}  // namespace orbitfuse::stages
