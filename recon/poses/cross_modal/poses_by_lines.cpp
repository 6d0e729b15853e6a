// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/poses_by_lines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/numeric/median.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {
namespace {

/// Below this the best start angle is not told from the next one (standard errors): refused.
constexpr double min_decisiveness = 1.0;
/// Below this the answer is given, with the rival named.
constexpr double clear_decisiveness = 2.5;
/// Stations are nominal to several degrees; beyond this a pose contradicts its station.
constexpr double max_station_deviation_deg = 12;
/// A view whose edges meet the lines worse than this share of the median view is not supported.
constexpr double min_share_of_median = 0.55;
/// Share of its distance that a view may leave the orbit's search by before it contradicts it.
constexpr double max_move = 0.15;

/// Mean of the paired differences in their own standard error.
double standard_errors_apart(const std::vector<double>& better, const std::vector<double>& worse) {
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < better.size(); ++i) {
    const double d = better[i] - worse[i];
    sum += d, squares += d * d;
  }
  const auto n = static_cast<double>(better.size());
  const double variance = std::max(squares / n - (sum / n) * (sum / n), 1e-12);
  return (sum / n) / std::sqrt(variance / n);
}

ViewVerdict dropped(DoubtReason reason, std::string detail) {
  return {Confidence::dropped, reason, std::move(detail)};
}

ViewVerdict verdict_of(const OrbitWork& work, const AlignedOrbit& best, std::size_t i,
                       double typical) {
  if (!(best.support[i] >= min_share_of_median * typical))
    return dropped(DoubtReason::weak_support,
                   fmt::format("its edges agree with the visible scene at {:.3f}, the median view "
                               "at {:.3f}",
                               best.support[i], typical));
  // Lines alone can pull a view astray.
  const Rigid3d& lined_up = best.views[i].view.cam_from_world;
  const Rigid3d expected = cam_from_world_of(best.hypothesis.poses[i], work.lens.camera);
  const Eigen::Vector3d place = camera_center(expected);
  const double moved = (camera_center(lined_up) - place).norm() / place.norm();
  if (!(moved < max_move))
    return dropped(DoubtReason::off_its_loop,
                   fmt::format("its edges pull it {:.0f} % of its distance away from where its "
                               "loop says it is",
                               100 * moved));
  const OrbitPrior prior = loop_prior(best.hypothesis.poses, best.hypothesis, i);
  const OrbitAngles angles = orbit_angles(camera_center(lined_up));
  const double away = std::remainder(angles.azimuth_deg - prior.pose.azimuth_deg, 360);
  if (!(std::abs(away) < max_station_deviation_deg))
    return dropped(DoubtReason::off_its_loop,
                   fmt::format("its edges fit best {:.0f} deg away from its station, judged by its "
                               "orbit",
                               std::abs(away)));
  return {Confidence::doubtful, DoubtReason::undecided,
          "placed by straight edges alone: no trained visible field was there to confirm it"};
}

Result<std::vector<AlignedOrbit>> aligned_hypotheses(const OrbitWork& work,
                                                     const std::vector<OrbitHypothesis>& hypotheses,
                                                     const Progress& progress) {
  std::vector<AlignedOrbit> aligned;
  for (const OrbitHypothesis& hypothesis : hypotheses) {
    progress.report({"poses.thermal", 2, 4, -1,
                     fmt::format("alignment from {:.0f} deg", hypothesis.offset_deg)});
    ORBITFUSE_ASSIGN(AlignedOrbit one, align_orbit(work, hypothesis, progress));
    aligned.push_back(std::move(one));
  }
  std::stable_sort(aligned.begin(), aligned.end(),
                   [](const AlignedOrbit& x, const AlignedOrbit& y) {
                     return x.mean_support() > y.mean_support();
                   });
  return aligned;
}

}  // namespace

Result<PlacedViews> place_by_lines(const OrbitWork& work,
                                   const std::vector<OrbitHypothesis>& hypotheses,
                                   const Similarity3d& canonical_from_visible,
                                   const Progress& progress) {
  ORBITFUSE_ASSIGN(const std::vector<AlignedOrbit> aligned,
                   aligned_hypotheses(work, hypotheses, progress));
  const AlignedOrbit& best = aligned.front();
  const double decisiveness =
      aligned.size() > 1 ? standard_errors_apart(best.support, aligned[1].support) : 1e3;
  PlacedViews placed;
  placed.method = "cross-modal, orbit prior";
  for (const AlignedOrbit& one : aligned)
    placed.why +=
        fmt::format("; start at {:.0f} deg{}: agreement {:.3f}", one.hypothesis.offset_deg,
                    one.hypothesis.mirrored ? " clockwise" : "", one.mean_support());
  placed.why += fmt::format("; {:.1f} standard errors apart", decisiveness);
  if (decisiveness < min_decisiveness)
    return fail(ErrorKind::quality, "poses.thermal", placed.why.substr(2) + ": undecided",
                "record more thermal stations, or thermal views whose edges show form");
  if (decisiveness < clear_decisiveness)
    placed.why += ": doubtful, check the start angle in the rendered pairs";
  Reconstruction model;
  for (const AlignmentView& v : best.views) model.views.push_back(v.view);
  move_world(model, canonical_from_visible.inverse());
  const double typical = median(best.support);
  for (std::size_t i = 0; i < model.views.size(); ++i)
    placed.views.push_back({model.views[i], verdict_of(work, best, i, typical), best.support[i],
                            best.report.residual_px[i]});
  placed.gates["orbit_decisiveness"] = decisiveness;
  placed.gates["focal_px"] = best.report.focal_px;
  placed.gates["focal_sigma_percent"] = 100 * best.report.focal_relative_sigma;
  return placed;
}

}  // namespace orbitfuse
