// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/stages/run_config.hpp"
#include "core/geometry/point_cloud.hpp"
#include "core/geometry/reconstruction.hpp"
#include "core/image/palette.hpp"
#include "core/session/session.hpp"
#include "fusion/heat/heat_scale.hpp"
#include "recon/assembly/training_data.hpp"
#include "recon/nerf/nerf.hpp"
#include "recon/nerf/photo_detail.hpp"

namespace orbitfuse::view {

/// A recorded camera, posed in the frame that the viewer shows.
struct RecordedView {
  Modality modality = Modality::visible;
  PosedView view;                    ///< name: its file in the session
  std::optional<std::string> doubt;  ///< why its pose may be wrong; absent: it is sure
};

/// What the viewer needs of a run, held in memory: the run's folder may change meanwhile.
/// Everything is in one frame, `frame`, which is also the world of measurements: the visible
/// poses', or the thermal ones' where nothing relates these to visible ones.
struct FinishedRun {
  std::filesystem::path out;
  /// Of fields, poses and registration: what was made of others is out of date. Empty: not known.
  std::string identity;
  std::optional<Session> session;  ///< nothing: it is not where the run read it, or another
  nerf::Field visible, thermal;    ///< one may be empty
  /// What recorded frames lend to pictures, as the run's new views have it.
  nerf::PhotoDetail visible_detail, thermal_detail;
  Modality frame = Modality::visible;
  Similarity3d frame_from_thermal;
  std::vector<RecordedView> views;
  Eigen::Vector3d center = Eigen::Vector3d::Zero(), up = Eigen::Vector3d::UnitZ();
  double radius = 1;   ///< of the recorded cameras round the centre
  PointCloud surface;  ///< colours, temperatures or both
  bool thermal_is_gray = false;
  /// From a gray thermal frame's levels to the field's; empty: they are.
  std::map<std::string, nerf::GrayCurve> gray_curves;
  double shading_k = 0;  ///< nerf::shading_image(): in every thermal frame, not in the field
  TemperatureSpan span;  ///< the run's, one for all its pictures
  HeatScale heat;
  stages::RunConfig config;
  std::vector<std::string> notes;  ///< what is not there, and why

  bool has(Modality modality) const {
    return !(modality == Modality::visible ? visible : thermal).empty();
  }
  bool has_detail() const { return !visible_detail.empty() || !thermal_detail.empty(); }
  Samples samples() const { return thermal_is_gray ? Samples::gray : Samples::kelvin; }
};

/// FinishedRun::identity of what lies in the folder now. Errors: input (a damaged record).
Result<std::string> identity_of_run(const std::filesystem::path& out);

/// Errors: input (no run, none of its fields, damaged files), cancelled.
Result<FinishedRun> load_finished_run(const std::filesystem::path& out,
                                      const stages::RunConfig& config, const Progress& progress);

}  // namespace orbitfuse::view
