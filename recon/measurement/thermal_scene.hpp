// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/progress.hpp"
#include "core/radiometry/flir_temperature.hpp"
#include "recon/measurement/located.hpp"
#include "recon/measurement/options.hpp"

// What measurements read: the trained thermal field and every recorded thermal frame, in one world.
namespace orbitfuse::measurement {

/// The thermal field as one camera sees it.
struct FieldView {
  cv::Mat temperature_k;  ///< CV_32FC1, NaN = nothing there
  cv::Mat depth;          ///< CV_32FC1 along the optical axis, world units; NaN = nothing there
};
/// Safe to call from several threads. Errors: the renderer's, cancelled.
using FieldRenderer =
    std::function<Result<FieldView>(const Camera&, const Rigid3d& cam_from_world, const Progress&)>;

/// A recorded thermal frame.
struct ThermalFrame {
  PosedView view;                    ///< in the scene's world; its name is the file in the session
  std::optional<std::string> doubt;  ///< why its pose may be wrong; absent: it is sure
  std::optional<FlirCalibration> radiometry;  ///< behind its temperatures, where the session has it
  bool doubtful() const { return doubt.has_value(); }
};

struct SceneParts {
  FieldRenderer field;
  std::vector<ThermalFrame> frames;
  /// Kelvin of frames[i], CV_32FC1 of its camera's size, NaN = dead pixel.
  std::function<Result<cv::Mat>(const ThermalFrame&)> read_frame;
  std::vector<PosedView> views;  ///< others that a pixel may be given in: rendered, visible
  std::set<std::string> doubtful_views = {};  ///< of these, such whose pose may be wrong
  /// Frames of the session that have no pose, so that nothing can be measured in them.
  std::vector<std::string> unposed = {};
  std::vector<std::string> outdated = {};  ///< views that were rendered of an earlier world
  std::vector<PosedView>
      orbit;  ///< cameras that say where the object is (recon/assembly/looked_at)
  /// Where distances begin and end; without a renderer: the thermal field and its sure frames.
  SurfaceSource surface = {};
  std::optional<double> metres_per_unit;  ///< none: the run's scale is unknown
  double scale_relative_sigma = 0;        ///< of metres_per_unit
  std::string identity;                   ///< of poses, fields and session; empty: not known
};

/// A point of the surface, with what the field has there.
struct SurfacePoint {
  Eigen::Vector3d position;
  Eigen::Vector3d normal;  ///< unit length, to the outside
  double field_k = 0;      ///< NaN: not known
  /// How far the field's temperature is from field_k within a pose error's reach of the point, RMS:
  /// near an edge a small error of the poses is a large one of the temperature. 0: not known.
  double variation_k = 0;
  double weight = 1;  ///< the area it stands for, in a region; only ratios matter
};

/// Loaded once and asked often. All functions are const and safe to call from several threads at
/// once; a frame's image and depth are made on first use, by one thread, while others that want
/// the same wait. Don't call them from inside parallel_for: that wait would hold its worker.
class ThermalScene {
 public:
  /// Errors: usage (options), input (no renderer, no frames, a camera or pose that is no such).
  static Result<ThermalScene> make(SceneParts parts, const MeasurementOptions& options = {});
  ThermalScene(ThermalScene&&) noexcept;
  ThermalScene& operator=(ThermalScene&&) noexcept;
  ~ThermalScene();

  const std::vector<ThermalFrame>& frames() const { return parts_.frames; }
  const MeasurementOptions& options() const { return options_; }
  const std::string& identity() const { return parts_.identity; }
  std::optional<double> metres_per_unit() const { return parts_.metres_per_unit; }
  double scale_relative_sigma() const { return parts_.scale_relative_sigma; }
  /// What the cameras of `orbit` went round: the point nearest to their axes and their median
  /// distance from it. None where they look in one direction.
  struct Middle {
    Eigen::Vector3d center;
    double radius;
  };
  const std::optional<Middle>& middle() const { return middle_; }

  /// A view by its name: thermal frames, then `views`. Input error with names that are alike.
  Result<const PosedView*> view(const std::string& name) const;
  bool has_view(const std::string& name) const;
  /// Its pose may be wrong, so that its pixels may show other places.
  bool is_doubtful(const std::string& view) const;

  /// CV_32FC1 kelvin of a frame. Errors: read_frame's, input (not of the camera's size).
  Result<cv::Mat> image(std::size_t frame) const;
  /// The field from a frame, options().depth_width_px wide, camera reduced_camera(frame).
  Result<FieldView> seen(std::size_t frame, const Progress& progress) const;
  Camera reduced_camera(std::size_t frame) const;

  /// The field from any camera. Errors of both: those of SceneParts::field.
  Result<FieldView> render(const Camera& camera, const Rigid3d& cam_from_world,
                           const Progress& progress) const {
    return parts_.field(camera, cam_from_world, progress);
  }
  /// The surface at a pixel of any posed camera. Input error where there is none (sky, a hole) or
  /// the pixel lies outside the picture.
  Result<SurfacePoint> surface_at(const PosedView& view, const Eigen::Vector2d& pixel,
                                  const Progress& progress) const;
  /// Where a distance ends: of SceneParts::surface, by all views. Errors: as surface_at(), and a
  /// point outside of the scene.
  Result<Located> locate(const PosedView& view, const Eigen::Vector2d& pixel,
                         const Progress& progress) const {
    return located(parts_.surface, view, pixel, progress);
  }
  Result<Located> locate(const Eigen::Vector3d& point, const Progress& progress) const;
  /// Input error for points of no scene: farther off than its surroundings, and in no picture.
  Status check_within(const Eigen::Vector3d& point) const;

 private:
  struct Cached;
  ThermalScene(SceneParts parts, const MeasurementOptions& options);
  SceneParts parts_;
  MeasurementOptions options_;
  std::optional<Middle> middle_;
  std::unique_ptr<std::vector<Cached>> cached_;
};

/// SurfacePoint::variation_k of a pixel in a rendered view (CV_32FC1, NaN = nothing there).
double variation_at(const cv::Mat& temperature_k, int x, int y, int reach);

/// Unit normal, in the camera's axes and towards it, of the plane through the depths round a pixel
/// of a map (CV_32FC1); none where fewer than three lie on one surface.
std::optional<Eigen::Vector3d> normal_at(const cv::Mat& depth, const Camera& camera, int x, int y,
                                         int reach);

}  // namespace orbitfuse::measurement
