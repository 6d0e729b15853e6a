// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "core/geometry/point_cloud.hpp"
#include "core/geometry/reconstruction.hpp"
#include "core/progress.hpp"
#include "recon/nerf/dataset.hpp"
#include "recon/nerf/field.hpp"
#include "recon/nerf/history.hpp"
#include "recon/nerf/options.hpp"

// Radiance fields on the CPU: a multiresolution hash grid (Müller et al. 2022, "Instant neural
// graphics primitives") with small MLPs, in contracted space (Barron et al. 2022, "Mip-NeRF 360").
namespace orbitfuse::nerf {

enum class StopReason { iterations, budget, target_psnr, plateau, cancelled };
const char* name(StopReason reason);

struct TrainReport : History {
  int iterations = 0;
  StopReason stop = StopReason::iterations;
  int best_step = 0;                 ///< the step whose parameters the field holds
  double best_psnr = 0;              ///< held-out, dB; NaN without held-out views
  std::vector<std::string> heldout;  ///< names of the views that measured
  std::map<std::string, double>
      image_offsets_k;  ///< of views that were not dropped (per_image_offset)
  /// What the lens adds to every view, as shading_image() takes it; 0: not told, or nothing
  /// (even_shading). The field is without it.
  double shading_k = 0;
  /// R, G, B of a view against the common exposure, which the field shows (even_exposure); empty:
  /// steady.
  std::map<std::string, std::array<double, 3>> image_gains;
  /// From a gray thermal view's levels to those that all share, which the field shows; empty: of
  /// one span already.
  std::map<std::string, GrayCurve> gray_curves;
  std::map<std::string, Rigid3d>
      refined_poses;   ///< cam_from_world by view, as training left it (refine_poses)
  std::string device;  ///< that made the steps; empty: the processor
  std::vector<Skip> skips;
  std::vector<std::string> warnings;  ///< views that were dropped, a target that was missed

  /// "4000 steps, 62.1 CPU s, held-out 26.9 dB (step 3600), 17 samples a ray".
  std::string brief() const;
};

/// Trains `field` from scratch, or on from its checkpoint (TrainOptions::resume), and leaves the
/// best parameters in it. `guide` (same world frame) supplies geometry when
/// options.shared_geometry is set. The same dataset, options and seed give the same field for any
/// thread count on one instruction set, unless budget_s ends the run.
///
/// The place in every schedule (learning rates, annealed losses) is step / iterations, or time
/// spent / budget_s if that is further, of the options in force. A run that goes on with more of
/// either therefore finds itself earlier in a longer schedule: its learning rates rise to where
/// that has them, and fall to the end as if the run had been that long from its start.
///
/// A thermal view of which more than half the pixels are NaN is dropped with a warning that names
/// it; fewer dead pixels are left out one by one, and a skip names the view that has most.
/// Errors: usage (options), input (dataset, checkpoint; each names what is wrong), quality (no step
/// had a finite gradient), cancelled (a checkpoint is written first).
Result<TrainReport> train(const Dataset& dataset, const TrainOptions& options,
                          const Progress& progress, Field& field, const Field* guide = nullptr);

/// Writes a finished run as a checkpoint, from which train() with `resume` and more iterations or
/// budget extends it. It goes on from the field, i.e. the best step's parameters, with the
/// optimiser's moments of the last step; a field that fell on held-out views (by more than 0.3 dB)
/// doesn't replace that one. Errors: input (an empty field), device.
Status save_checkpoint(Field finished, const TrainReport& report,
                       const std::filesystem::path& checkpoint);

struct RenderOptions {
  double stop_transmittance = 1e-3;  ///< a ray ends when less light than this is left
  double sample_factor =
      1;  ///< samples per ray, as a multiple of those in training (Sampling::occupancy)
  /// Rays spread their samples over the way to a little behind what their neighbours met, and go on
  /// to the end only if nothing stopped them: finer samples, a third less time.
  bool look_ahead = true;
  /// For pictures that are waited for: of thirteen pixels in sixteen, those whose four neighbours
  /// differ by no more than this share of the value range, and lie on one surface, are their mean
  /// instead of being rendered. 0 = all are rendered.
  double alike = 0;
  /// With `alike`, pixels between those that are rendered in any case: 2, or 4 where the field has
  /// nothing finer than three pixels, as a thermal camera's has that sees less than the picture.
  int alike_px = 2;
  /// With `alike`: a ray among four that met something looks where they did, and all the way only
  /// where that doesn't do. What is thinner than two pixels before a near surface can be missed.
  bool between_neighbours = false;
  /// RenderedView::depth is where so much of a ray's light is left. A smooth surface of little
  /// detail is learned as a ramp of density that begins before it: its middle lies behind.
  double surface_light = 0.5;
  Status validate() const;
};

/// A rendered camera. Where more than RenderOptions::surface_light (one half) of the light is left,
/// depth is NaN (sky, background); DepthMap,
/// which training takes, has infinite depth for known sky and NaN for what is not known.
struct RenderedView {
  cv::Mat color;    ///< CV_32FC3 R, G, B in 0..1, or CV_32FC1 kelvin
  cv::Mat depth;    ///< CV_32FC1, z along the optical axis, world units
  cv::Mat opacity;  ///< CV_32FC1, 0..1
};

/// The field as the camera sees it, at the camera's size; pose in the world frame of the training
/// views. Errors: usage (options), input (camera, pose, a field that is empty), cancelled.
Result<RenderedView> render(const Field& field, const Camera& camera, const Rigid3d& cam_from_world,
                            const RenderOptions& options, const Progress& progress);

struct KeptRenders;

struct ExportOptions {
  /// Depth maps are rendered at this width, and every second pixel may be a point: some 250,000 of
  /// 24 views, of which registration takes 2,500. At DetailOptions::base_width_px the detail of new
  /// views asks for the same renders.
  int max_width = 320;
  int min_consistent_views = 2;   ///< other views that must agree with a point's depth
  double depth_tolerance = 0.01;  ///< relative agreement
  double max_distance = 3.0;      ///< from the field's centre, in field radii; sheds background
  double voxel = 0.004;           ///< one point per cube of this size, in field radii; 0 = all
  Status validate() const;
};

/// Points with normals from rendered depth, kept where other views agree; colours (visible) or
/// temperatures (thermal). In the world frame of the views. `kept`: of the field's renders, asked
/// first and added to; may be null. Errors: usage (options), input (no view), cancelled.
Result<PointCloud> export_point_cloud(const Field& field, const std::vector<PosedView>& views,
                                      const ExportOptions& options, const Progress& progress,
                                      KeptRenders* kept = nullptr);

}  // namespace orbitfuse::nerf
