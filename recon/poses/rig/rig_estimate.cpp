// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/rig/rig_estimate.hpp"

#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "core/geometry/lens_fold.hpp"
#include "core/geometry/narrowed.hpp"
#include "core/geometry/rotation_vector.hpp"
#include "core/image/undistorted.hpp"
#include "core/numeric/median.hpp"
#include "core/system/parallel.hpp"
#include "recon/alignment/edge_field.hpp"
#include "recon/alignment/patch_matching.hpp"
#include "recon/alignment/patch_residual.hpp"
#include "recon/alignment/render_alignment.hpp"
#include "recon/poses/index.hpp"
#include "recon/poses/rig/rig_image.hpp"

namespace orbitfuse {
namespace {

Camera thermal_camera(const Camera& lens, double focal_px, int width) {
  Camera camera = lens;
  camera.fx = camera.fy = focal_px;
  return at_width(camera, width);
}

/// Edges of an image whose NaN pixels show nothing.
cv::Mat edges_of(const cv::Mat& image) {
  cv::Mat field = orientation_field(image, 1.0);
  cv::Mat blind = image != image;
  cv::dilate(blind, blind, {}, {-1, -1}, 4);  // the border of what is shown is no edge
  field.setTo(cv::Scalar::all(0), blind);
  return field;
}

cv::Mat energy_of(const cv::Mat& field) {
  cv::Mat parts[2];
  cv::split(field, parts);
  return parts[0].mul(parts[0]) + parts[1].mul(parts[1]);
}

/// Where the thermal image lies in the photo, by the correlation of all edges at all shifts, summed
/// over all pairs: the same shift in each.
struct Place {
  double focal_px = 0;  ///< at the recorded width
  Eigen::Quaterniond thermal_from_visible = Eigen::Quaterniond::Identity();
  double score = -1;
};

class ShiftSearch {
 public:
  ShiftSearch(const std::vector<RigView>& views, const RigOptions& options)
      : views_(views), options_(options) {
    const Camera& lens = options.thermal_lens;
    const Camera camera = thermal_camera(lens, 1, width).without_distortion();
    for (const RigView& view : views) {
      thermal_.push_back(edges_at(straightened(view.thermal, lens), camera));
      energy_.push_back(cv::sum(energy_of(thermal_.back()))[0]);
    }
  }

  /// The best place at one focal length, for right pairs and (into `wrong`) for shuffled ones.
  Place best_at(double focal_px, double& wrong) const {
    Camera wide = thermal_camera(options_.thermal_lens, focal_px, width).without_distortion();
    wide.width += 2 * margin, wide.height += 2 * margin;
    wide.cx += margin, wide.cy += margin;
    const int controls = std::min<int>(3, static_cast<int>(views_.size()) - 1);
    std::vector<std::vector<cv::Mat>> scores(views_.size());
    parallel_for(static_cast<int>(views_.size()), [&](int i) {
      const RigView& view = views_[at(i)];
      const cv::Mat field = edges_of(
          seen_from(view.visible, view.visible_camera, Eigen::Quaterniond::Identity(), wide));
      for (int k = 0; k <= controls; ++k) {
        const std::size_t j = (at(i) + at(k)) % views_.size();
        scores[at(i)].push_back(correlation(field, j));
      }
    });
    Place best;
    for (int k = 0; k <= controls; ++k) {
      cv::Mat sum = scores[0][at(k)].clone();
      for (std::size_t i = 1; i < scores.size(); ++i) sum += scores[i][at(k)];
      cv::GaussianBlur(sum, sum, {}, 1.0);
      double value = 0;
      cv::Point peak;
      cv::minMaxLoc(sum, nullptr, &value, nullptr, &peak);
      value /= static_cast<double>(views_.size());
      if (k > 0) {
        wrong = std::max(wrong, value);
        continue;
      }
      const Camera camera = thermal_camera(options_.thermal_lens, focal_px, width);
      const Eigen::Vector3d axis((peak.x - margin) / camera.fx, (peak.y - margin) / camera.fy, 1);
      best = {focal_px, Eigen::Quaterniond::FromTwoVectors(axis, Eigen::Vector3d::UnitZ()), value};
    }
    return best;
  }

 private:
  static constexpr int width = 160, margin = 56;

  cv::Mat correlation(const cv::Mat& field, std::size_t j) const {
    cv::Mat product, energy, ones = cv::Mat::ones(thermal_[j].size(), CV_32F);
    cv::matchTemplate(field, thermal_[j], product, cv::TM_CCORR);
    cv::matchTemplate(energy_of(field), ones, energy, cv::TM_CCORR);
    // A corner of the photo with hardly an edge must not win by its small norm.
    cv::max(energy, 0.25 * energy_[j], energy);
    cv::Mat norm;
    cv::sqrt(energy * energy_[j], norm);
    cv::max(norm, 1e-6, norm);
    return product / norm;
  }

  const std::vector<RigView>& views_;
  const RigOptions& options_;
  std::vector<cv::Mat> thermal_;
  std::vector<double> energy_;
};

std::vector<double> focal_lengths(const RigOptions& options) {
  const double width = options.thermal_lens.width;
  std::vector<double> list;
  constexpr double step = 1.04;
  if (options.focal_relative_sigma > options.search_from) {
    for (double f = width / 2 / std::tan(EIGEN_PI / 4); f < width / 2 / std::tan(EIGEN_PI / 30);
         f *= step)
      list.push_back(f);
    return list;
  }
  const int reach = static_cast<int>(std::ceil(2 * options.focal_relative_sigma / std::log(step)));
  for (int i = -reach; i <= reach; ++i) list.push_back(options.thermal_lens.fx * std::pow(step, i));
  return list;
}

/// What a round changes of the rig as it was before: its pose and the thermal lens.
struct RigStep {
  std::array<double, 6> pose{};
  double log_focal = 0, radial = 0;
};

struct RigPrior {
  double shift_sigma, log_focal_mean, log_focal_sigma, radial_mean, radial_sigma;

  template <class T>
  bool operator()(const T* pose, const T* log_focal, const T* radial, T* residual) const {
    for (int i = 0; i < 3; ++i) residual[i] = pose[3 + i] / T(shift_sigma);
    residual[3] = (log_focal[0] - T(log_focal_mean)) / T(log_focal_sigma);
    residual[4] = (radial[0] - T(radial_mean)) / T(radial_sigma);
    return true;
  }
};

struct RoundResult {
  std::vector<std::vector<PatchMatch>> matches;
  std::vector<cv::Mat> edges, fields;
  Camera camera;
};

RoundResult match_round(const std::vector<RigView>& views, const RigEstimate& rig,
                        const RenderRound& round) {
  RoundResult result;
  const int width = std::min(round.width_px, rig.thermal.width);
  result.camera = thermal_camera(rig.thermal, rig.thermal.fx, width).without_distortion();
  result.matches.resize(views.size());
  result.edges.resize(views.size());
  result.fields.resize(views.size());
  parallel_for(static_cast<int>(views.size()), [&](int i) {
    const RigView& view = views[at(i)];
    const Eigen::Quaterniond& turn = rig.thermal_from_visible.rotation;
    SceneRender seen;
    seen.brightness = seen_from(view.visible, view.visible_camera, turn, result.camera);
    std::vector<Eigen::Vector3d> turned;
    for (const Eigen::Vector3d& point : view.points) turned.push_back(turn * point);
    seen.depth = sparse_depth(turned, result.camera);
    result.edges[at(i)] = edges_of(seen.brightness);
    result.fields[at(i)] = edges_at(straightened(view.thermal, rig.thermal), result.camera);
    result.matches[at(i)] =
        match_patches(seen, result.edges[at(i)], result.camera, result.fields[at(i)],
                      {round.search_px, round.patch_search_px, round.patch_radius_px, 8});
  });
  return result;
}

/// The rig and the lens from all pairs' patches, the robust scale lowered step by step.
RigStep solve(const RoundResult& round, const RigOptions& options, double depth,
              const RigEstimate& rig, bool bent) {
  RigStep step;
  for (int i = 0; i < 3; ++i) step.pose[at(3 + i)] = rig.thermal_from_visible.translation[i];
  if (!bent) step.radial = options.thermal_lens.k1 - rig.thermal.k1;
  const bool searched = options.focal_relative_sigma > options.search_from;
  for (const double scale_px : {8.0, 4.0, 2.0, 1.0}) {
    ceres::Problem problem;
    for (const auto& matches : round.matches)
      for (const PatchMatch& match : matches)
        problem.AddResidualBlock(new PatchCost(match, round.camera),
                                 new ceres::ScaledLoss(new ceres::CauchyLoss(scale_px), match.score,
                                                       ceres::TAKE_OWNERSHIP),
                                 step.pose.data(), &step.log_focal, &step.radial);
    const double mean = searched ? 0 : std::log(options.thermal_lens.fx / rig.thermal.fx);
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<RigPrior, 5, 6, 1, 1>(new RigPrior{
            options.baseline_sigma * depth, mean,
            std::max(1e-4, searched ? 0.1 : options.focal_relative_sigma),
            options.thermal_lens.k1 - rig.thermal.k1, std::max(1e-4, options.radial_sigma)}),
        nullptr, step.pose.data(), &step.log_focal, &step.radial);
    if (!bent) problem.SetParameterBlockConstant(&step.radial);  // at the lens' own
    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::DENSE_QR;
    solver.num_threads = 1;  // more sum in any order
    solver.max_num_iterations = 30;
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem, &summary);
  }
  return step;
}

int held_patches(const RoundResult& round, const RigStep& step) {
  int held = 0;
  for (const auto& matches : round.matches)
    held += patch_fit(matches, round.camera, CorrectedPose(step.pose), step.log_focal, step.radial)
                .matches;
  return held;
}

/// Whether the lens bends beside what is known of it: where that holds clearly more patches, and
/// shows the whole image. k1 is little held by what is near the middle of the images, and a wrong
/// one misplaces their corners.
bool bends(const RoundResult& round, const RigEstimate& rig, const RigStep& straight,
           const RigStep& bent) {
  constexpr double clearly_more = 1.03;
  Camera lens = rig.thermal;
  lens.k1 += bent.radial;
  const double focal_px = lens.fx * std::exp(bent.log_focal),
               corner = std::hypot(lens.width, lens.height) / 2 / focal_px;
  return corner * corner < fold_of(lens) &&
         held_patches(round, bent) > clearly_more * held_patches(round, straight);
}

/// Of the quarters of an image that have some patches, how many are there and how many lie
/// elsewhere than the rig has them: a common shift of 2 px or more explains a quarter more of their
/// patches.
void judge_quarters(const std::vector<PatchMatch>& matches, const Camera& camera,
                    const RigStep& step, RigPairFit& fit) {
  constexpr std::size_t fewest = 12;
  constexpr int reach_px = 6;
  const CorrectedPose pose(step.pose);
  using Residual = std::pair<Eigen::Vector2d, Eigen::Matrix2d>;
  std::array<std::vector<Residual>, 4> quarters;
  for (const PatchMatch& match : matches) {
    const auto residual = patch_residual(match, camera, pose, step.log_focal, step.radial);
    const std::size_t quarter = (match.seen.x() > camera.width / 2.0 ? 1U : 0U) +
                                (match.seen.y() > camera.height / 2.0 ? 2U : 0U);
    if (residual) quarters[quarter].emplace_back(*residual, match.sqrt_weight);
  }
  fit.quarters = fit.quarters_elsewhere = 0;
  for (const std::vector<Residual>& patches : quarters) {
    if (patches.size() < fewest) continue;
    const auto held = [&](const Eigen::Vector2d& shift) {
      return std::count_if(patches.begin(), patches.end(), [&](const Residual& one) {
        return (one.first - one.second * shift).norm() < 2;
      });
    };
    std::ptrdiff_t best = 0;
    for (int y = -reach_px; y <= reach_px; ++y)
      for (int x = -reach_px; x <= reach_px; ++x)
        if (x * x + y * y >= 4) best = std::max(best, held({x, y}));
    ++fit.quarters;
    // Of so many shifts one holds some patches of noise.
    if (2 * static_cast<std::size_t>(best) >= fewest && 4 * best > 5 * held({0, 0}))
      ++fit.quarters_elsewhere;
  }
}

void judge(const RoundResult& round, const RigStep& step, RigEstimate& rig) {
  const int count = static_cast<int>(round.edges.size());
  rig.pairs.assign(at(count), {});
  for (int i = 0; i < count; ++i) {
    RigPairFit& fit = rig.pairs[at(i)];
    const PatchFit patches = patch_fit(round.matches[at(i)], round.camera, CorrectedPose(step.pose),
                                       step.log_focal, step.radial);
    fit.found = static_cast<int>(round.matches[at(i)].size());
    fit.matches = patches.matches;
    fit.median_px = patches.median_px;
    judge_quarters(round.matches[at(i)], round.camera, step, fit);
    fit.agreement = edge_agreement(round.edges[at(i)], round.fields[at(i)]);
    for (int j = 0; j < count; ++j)
      if (j != i)
        fit.control += edge_agreement(round.edges[at(i)], round.fields[at(j)]) / (count - 1);
  }
  double sum = 0, squares = 0, found = 0, held = 0, quarters = 0, elsewhere = 0;
  rig.agreement = rig.control = 0;
  for (const RigPairFit& fit : rig.pairs) {
    found += fit.found, held += fit.matches;
    quarters += fit.quarters, elsewhere += fit.quarters_elsewhere;
    rig.agreement += fit.agreement / count;
    rig.control += fit.control / count;
    const double d = fit.agreement - fit.control;
    sum += d, squares += d * d;
  }
  rig.held_share = found > 0 ? held / found : 0;
  rig.elsewhere_share = quarters > 0 ? elsewhere / quarters : 0;
  const double mean = sum / count, variance = std::max(squares / count - mean * mean, 1e-9);
  rig.decisiveness = mean / std::sqrt(variance / count);
}

double median_depth(const std::vector<RigView>& views) {
  std::vector<double> depths;
  for (const RigView& view : views)
    for (const Eigen::Vector3d& point : view.points) depths.push_back(point.z());
  return depths.empty() ? 1.0 : median(depths);
}

}  // namespace

std::string RigEstimate::words() const {
  std::vector<double> residuals;
  int matches = 0;
  for (const RigPairFit& fit : pairs) {
    residuals.push_back(fit.median_px);
    matches += fit.matches;
  }
  return fmt::format(
      "{} pairs, turned by {:.1f} deg, focal length {:.0f} px, k1 {:.2f}; edges agree {:.3f}, in "
      "shuffled pairs {:.3f} ({:.1f} standard errors apart), {} patches ({:.2f} of those found) at "
      "{:.2f} px of {}, {:.2f} of the images' quarters lie elsewhere",
      pairs.size(), Eigen::AngleAxisd(thermal_from_visible.rotation).angle() * 180 / EIGEN_PI,
      thermal.fx, thermal.k1, agreement, control, decisiveness, matches, held_share,
      median(residuals), judged_width_px, elsewhere_share);
}

Result<RigEstimate> estimate_rig(const std::vector<RigView>& views, const RigOptions& options,
                                 const Progress& progress) {
  const auto refused = [](const std::string& found) {
    return fail(ErrorKind::quality, "poses.rig", found,
                "pair only images that were shot at once by cameras fixed to each other");
  };
  if (views.size() < 4)
    return refused(fmt::format("{} pairs, at least 4 are needed", views.size()));
  const ShiftSearch search(views, options);
  Place best;
  double wrong = -1;
  for (const double focal_px : focal_lengths(options)) {
    ORBITFUSE_TRY(progress.check("poses.rig"));
    const Place place = search.best_at(focal_px, wrong);
    if (place.score > best.score) best = place;
  }
  // What can't be told from a shuffled order now is refused however well it is aligned later.
  if (!(best.score >= options.min_search_lead * wrong))
    return refused(
        fmt::format("{} pairs: correlation of all edges {:.3f}, of shuffled pairs {:.3f} at best",
                    views.size(), best.score, wrong));
  RigEstimate rig;
  rig.thermal = options.thermal_lens;
  rig.thermal.fx = rig.thermal.fy = best.focal_px;
  rig.thermal_from_visible.rotation = best.thermal_from_visible;
  const double depth = median_depth(views);
  RoundResult matched;
  RigStep step;
  std::optional<bool> bent;
  constexpr RenderRound rounds[] = {
      {.width_px = 160, .search_px = 8, .patch_search_px = 8, .patch_radius_px = 18},
      {.width_px = 160, .search_px = 5, .patch_search_px = 7, .patch_radius_px = 14},
      {.width_px = 320, .search_px = 6, .patch_search_px = 8, .patch_radius_px = 16},
      {.width_px = 320, .search_px = 4, .patch_search_px = 6, .patch_radius_px = 12},
      {.width_px = 320, .search_px = 3, .patch_search_px = 5, .patch_radius_px = 10}};
  for (const RenderRound& round : rounds) {
    ORBITFUSE_TRY(progress.check("poses.rig"));
    matched = match_round(views, rig, round);
    std::size_t patches = 0;
    for (const auto& matches : matched.matches) patches += matches.size();
    if (patches < 12 * views.size() / 2)
      return refused(fmt::format("{} patches of {} photos are found in the thermal images", patches,
                                 views.size()));
    step = solve(matched, options, depth, rig, bent.value_or(false));
    // Asked once, when the pose is nearly right and all of the image can be matched.
    if (!bent && round.width_px == RigEstimate::judged_width_px) {
      const RigStep other = solve(matched, options, depth, rig, true);
      bent = bends(matched, rig, step, other);
      if (*bent) step = other;
    }
    const auto& pose = step.pose;
    const Eigen::Quaterniond more = turned_by({pose[0], pose[1], pose[2]});
    rig.thermal_from_visible.rotation = (more * rig.thermal_from_visible.rotation).normalized();
    rig.thermal_from_visible.translation = {pose[3], pose[4], pose[5]};
    rig.thermal.fx = rig.thermal.fy = rig.thermal.fx * std::exp(step.log_focal);
    rig.thermal.k1 += step.radial;
  }
  judge(matched, step, rig);
  const bool agrees = rig.decisiveness >= options.min_decisiveness &&
                      rig.elsewhere_share <= options.max_elsewhere_share;
  if (agrees && rig.held_share >= options.min_held_share) return rig;
  const bool would_do = agrees && rig.held_share >= declared_held_share;
  return refused(fmt::format(
      "{}; correlation of all edges {:.3f}, of shuffled pairs {:.3f} at best{}", rig.words(),
      best.score, wrong,
      would_do ? " (if the two cameras are fixed to each other, say so: import --rig)" : ""));
}

}  // namespace orbitfuse
