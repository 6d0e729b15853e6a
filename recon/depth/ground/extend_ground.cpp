// SPDX-License-Identifier: BSD-3-Clause
#include "recon/depth/ground/extend_ground.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "core/numeric/median.hpp"
#include "core/system/parallel.hpp"
#include "recon/depth/ground/panorama.hpp"
#include "recon/depth/ground/witnesses.hpp"

namespace orbitfuse::depth {
namespace {

/// Nearer to the centre than this lies the object, which is never taken for ground.
constexpr float least_radius = 1.3f;
/// A ray that meets the plane at a smaller slope says nothing of where.
constexpr float min_slope = 1e-4f;
/// Of the ground's confirmed gray levels; a little more than its texture shows.
constexpr double low_share = 0.02, high_share = 0.98;
constexpr int gray_margin = 6;
/// Cosine between the plane and a confirmed surface that speaks for it: the foot of a wall lies in
/// the plane too.
constexpr float level_cosine = 0.6f;
/// Width of the neighbourhood in which a confirmed depth speaks for its surroundings, of the width
/// of a map.
constexpr double reach_share = 0.02, sky_reach_share = 0.005;
/// The sky begins this far above the horizon (sine).
constexpr float sky_slope = 0.005f;
/// And it ends before the ground is as near as this, where plains of some tens of metres end; the
/// wall of a room goes on.
constexpr float horizon_reach = 5;
/// Gray levels by which sky and far ground change over so many pixels of a way; by more, something
/// else begins.
constexpr int sky_change = 7, ground_change = 16, edge_px = 4;
/// Of a map's pixels, and by how much depth may change from one to the next.
constexpr double least_region = 3e-4;
constexpr float region_step = 0.04f;
/// As an own match that one view confirms.
constexpr float confidence = 0.5f;

struct GrayRange {
  int low = 0, high = -1;
  bool holds(int gray) const { return gray >= low && gray <= high; }
};

bool on_ground(const LevelPlane& ground, const Eigen::Vector3f& x) {
  // Depth errors grow with the distance.
  return std::abs(ground.above(x.cast<double>())) < 0.02 + 0.01 * static_cast<double>(x.norm());
}

/// Gray levels of the confirmed ground, of all views.
GrayRange ground_levels(const std::vector<DepthView>& views, const std::vector<cv::Mat>& smooth,
                        const LevelPlane& ground, const std::vector<cv::Mat>& known) {
  std::vector<int> levels;
  for (std::size_t i = 0; i < views.size(); ++i)
    for (int y = 0; y < known[i].rows; y += 2)
      for (int x = 0; x < known[i].cols; x += 2) {
        const float z = known[i].at<float>(y, x);
        if (std::isfinite(z) && on_ground(ground, world_of(views[i], {x + 0.5, y + 0.5}, z)))
          levels.push_back(smooth[i].at<std::uint8_t>(y, x));
      }
  if (levels.empty()) return {};
  const int low = quantile(levels, low_share), high = quantile(levels, high_share);
  return {low - gray_margin, high + gray_margin};
}

/// What any view confirmed that is not the ground, as depths in `view`: the nearest; beyond
/// `nothing` where there is none.
cv::Mat obstacles(const DepthView& view, const std::vector<std::vector<Eigen::Vector3f>>& raised,
                  cv::Size size) {
  cv::Mat nearest(size, CV_32FC1, cv::Scalar(2 * nothing));
  for (const auto& points : raised)
    for (const Eigen::Vector3f& x : points) {
      const Eigen::Vector3f c = view.world_rotation * x + view.translation;
      if (!(c.z() > 0.02f)) continue;
      const Eigen::Vector2d at = view.camera.project(c.cast<double>());
      if (!(at.x() >= 0 && at.y() >= 0 && at.x() < size.width && at.y() < size.height)) continue;
      float& here = nearest.at<float>(static_cast<int>(at.y()), static_cast<int>(at.x()));
      here = std::min(here, c.z());
    }
  return nearest;
}

/// The nearest of the neighbourhood, so many widths of the map to each side.
cv::Mat spread(const cv::Mat& nearest, double share) {
  const int reach = std::max(1, static_cast<int>(std::lround(share * nearest.cols)));
  cv::Mat out;
  cv::erode(nearest, out,
            cv::getStructuringElement(cv::MORPH_RECT, {2 * reach + 1, 2 * reach + 1}));
  return out;
}

/// The map without specks: neighbours of like depth of which there are few, as chance matches along
/// a horizon are.
cv::Mat without_specks(const cv::Mat& depth) {
  const auto at_least = static_cast<std::size_t>(least_region * static_cast<double>(depth.total()));
  cv::Mat out = depth.clone(), seen = cv::Mat::zeros(depth.size(), CV_8UC1);
  const cv::Rect all({}, depth.size());
  std::vector<cv::Point> region;
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x) {
      if (seen.at<std::uint8_t>(y, x) || !std::isfinite(depth.at<float>(y, x))) continue;
      region.assign(1, {x, y});
      seen.at<std::uint8_t>(y, x) = 1;
      for (std::size_t i = 0; i < region.size(); ++i)
        for (const cv::Point step : {cv::Point{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
          const cv::Point here = region[i], next = here + step;
          if (!all.contains(next) || seen.at<std::uint8_t>(next)) continue;
          const float a = depth.at<float>(here), b = depth.at<float>(next);
          if (!(std::abs(a - b) < region_step * a)) continue;
          seen.at<std::uint8_t>(next) = 1;
          region.push_back(next);
        }
      if (region.size() >= at_least) continue;
      for (const cv::Point& p : region) out.at<float>(p) = std::numeric_limits<float>::quiet_NaN();
    }
  return out;
}

std::vector<Eigen::Vector3f> raised_points(const DepthView& view, const LevelPlane& ground,
                                           const cv::Mat& depth) {
  std::vector<Eigen::Vector3f> out;
  for (int y = 0; y < depth.rows; y += 2)
    for (int x = 0; x < depth.cols; x += 2) {
      const float z = depth.at<float>(y, x);
      if (!std::isfinite(z)) continue;
      const Eigen::Vector3f point = world_of(view, {x + 0.5, y + 0.5}, z);
      if (!on_ground(ground, point)) out.push_back(point);
    }
  return out;
}

class Extension {
 public:
  Extension(const DepthView& view, const LevelPlane& ground, GrayRange levels,
            const cv::Mat& smooth, const cv::Mat& obstacles, const cv::Mat& near_obstacles,
            const cv::Mat& known, const cv::Mat& normal, const Panorama& panorama)
      : view_(view),
        ground_(ground),
        levels_(levels),
        smooth_(smooth),
        obstacles_(obstacles),
        near_obstacles_(near_obstacles),
        known_(known),
        normal_(normal),
        panorama_(panorama),
        open_(known.size(), CV_8UC1, cv::Scalar(undecided)),
        clear_(known.size(), CV_8UC1, cv::Scalar(undecided)),
        ends_(known.size(), CV_8UC1, cv::Scalar(undecided)),
        up_(view.world_rotation * ground.normal.cast<float>()),
        nadir_(-(view.world_rotation.cast<double>() * ground.normal)) {}

  /// The depth of the pixel on the plane, at most `far` from the centre; infinite in the sky; NaN
  /// where it is neither.
  float depth(cv::Point pixel, float far) {
    const float none = std::numeric_limits<float>::quiet_NaN();
    const float rise = rise_of(pixel);
    if (rise > sky_slope && clear_sky(pixel) && ends_about_the_horizon(pixel))
      return std::numeric_limits<float>::infinity();
    if (!(-rise > min_slope)) return none;
    const Eigen::Vector3f place = place_on_ground(pixel, -rise);
    const float z = (view_.world_rotation * place + view_.translation).z();
    if (place.norm() < least_radius || obstacles_.at<float>(pixel) < hides * z) return none;
    // A body shows its upper edge somewhere above its plain middle.
    if (!open_ground(pixel) || panorama_.hides(place, hides)) return none;
    return z * far / std::max(far, place.norm());
  }

 private:
  enum : std::uint8_t { undecided = 2 };

  Eigen::Vector3d ray_of(cv::Point pixel) const {
    return view_.camera.ray_of({pixel.x + 0.5, pixel.y + 0.5});
  }

  /// Sine of the pixel's ray above the horizon.
  float rise_of(cv::Point pixel) const { return ray_of(pixel).cast<float>().normalized().dot(up_); }

  /// Where the pixel's ray meets the plane, which it falls towards with that sine.
  Eigen::Vector3f place_on_ground(cv::Point pixel, float fall) const {
    const Eigen::Vector3f direction =
        view_.world_rotation.transpose() * ray_of(pixel).cast<float>().normalized();
    const auto height = static_cast<float>(ground_.above(view_.center().cast<double>()));
    return view_.center() + height / fall * direction;
  }

  /// One pixel on the ground's way to the camera's foot: towards the image of the nadir.
  cv::Point step_to_foot(cv::Point pixel) const {
    const Eigen::Vector3d ray = ray_of(pixel);
    const double dx = (nadir_.x() - ray.x() * nadir_.z()) * view_.camera.fx;
    const double dy = (nadir_.y() - ray.y() * nadir_.z()) * view_.camera.fy;
    const double longest = std::max({std::abs(dx), std::abs(dy), 1e-12});
    return {static_cast<int>(std::lround(dx / longest)),
            static_cast<int>(std::lround(dy / longest))};
  }

  int change_along(cv::Point pixel, cv::Point step) const {
    const cv::Point ahead = pixel + edge_px * step;
    const cv::Rect all({}, known_.size());
    return all.contains(ahead)
               ? std::abs(smooth_.at<std::uint8_t>(pixel) - smooth_.at<std::uint8_t>(ahead))
               : 0;
  }

  enum class Way { blocked, open, goes_on };

  /// Follows a way pixel by pixel until `judge` knows; its end at the border is `at_border`.
  /// `memory` keeps what was found for all pixels of the way.
  template <class Judge>
  bool follow(cv::Mat& memory, cv::Point from, int direction, bool at_border, Judge judge) const {
    const cv::Rect all({}, known_.size());
    const auto longest = static_cast<std::size_t>(all.width + all.height);
    std::vector<cv::Point> way;
    bool open = at_border;
    for (cv::Point at = from; all.contains(at) && way.size() < longest;) {
      if (memory.at<std::uint8_t>(at) != undecided) {
        open = memory.at<std::uint8_t>(at) != 0;
        break;
      }
      way.push_back(at);
      const cv::Point step = direction * step_to_foot(at);
      const Way found = judge(at, step);
      if (found != Way::goes_on) {
        open = found == Way::open;
        break;
      }
      at += step;
    }
    for (const cv::Point& at : way) memory.at<std::uint8_t>(at) = open ? 1 : 0;
    return open;
  }

  /// Something is confirmed here, or something else begins.
  bool begins(cv::Point at, cv::Point step) const {
    return std::isfinite(known_.at<float>(at)) || near_obstacles_.at<float>(at) < nothing ||
           change_along(at, step) > sky_change;
  }

  /// Whether nothing else begins from here up to the image's border.
  bool clear_sky(cv::Point pixel) {
    return follow(clear_, pixel, -1, true, [&](cv::Point at, cv::Point step) {
      return begins(at, step) ? Way::blocked : Way::goes_on;
    });
  }

  /// Whether something else begins on the way down while the ground is far: the sky ends there, and
  /// a room's plain wall does not.
  bool ends_about_the_horizon(cv::Point pixel) {
    return follow(ends_, pixel, 1, false, [&](cv::Point at, cv::Point step) {
      // What begins does so somewhere up to there.
      const cv::Point ahead = at + edge_px * step;
      const float fall = -rise_of(ahead);
      if (fall > min_slope && place_on_ground(ahead, fall).norm() < horizon_reach)
        return Way::blocked;
      return begins(at, step) ? Way::open : Way::goes_on;
    });
  }

  /// The confirmed surface is the ground's.
  bool is_ground(cv::Point at, float z) const {
    const auto& n = normal_.at<cv::Vec3f>(at);
    return std::abs(n[0] * up_.x() + n[1] * up_.y() + n[2] * up_.z()) > level_cosine &&
           on_ground(ground_, world_of(view_, {at.x + 0.5, at.y + 0.5}, z));
  }

  /// Whether the first confirmed depth on the way to the foot is the ground's, and all before it
  /// may be.
  bool open_ground(cv::Point pixel) {
    return follow(open_, pixel, 1, false, [&](cv::Point at, cv::Point step) {
      if (const float z = known_.at<float>(at); std::isfinite(z))
        return is_ground(at, z) ? Way::open : Way::blocked;
      const bool like_ground =
          levels_.holds(smooth_.at<std::uint8_t>(at)) && change_along(at, step) <= ground_change;
      return like_ground ? Way::goes_on : Way::blocked;
    });
  }

  const DepthView& view_;
  const LevelPlane& ground_;
  GrayRange levels_;
  const cv::Mat &smooth_, &obstacles_, &near_obstacles_;
  const cv::Mat &known_, &normal_;
  const Panorama& panorama_;
  cv::Mat open_, clear_, ends_;
  Eigen::Vector3f up_;     ///< in camera axes
  Eigen::Vector3d nadir_;  ///< in camera axes
};

/// Writes what is found to the map and counts it, in pixels.
OpenSpace fill(Extension& extension, const Witnesses& witnesses, const cv::Mat& known,
               const Eigen::Vector3f& normal, float far, std::size_t view, DepthMap& map) {
  OpenSpace filled;
  map.depth = map.depth.clone();
  for (int y = 0; y < map.depth.rows; ++y)
    for (int x = 0; x < map.depth.cols; ++x) {
      if (std::isfinite(known.at<float>(y, x))) continue;
      const float z = extension.depth({x, y}, far);
      if (std::isnan(z) || !witnesses.agree(view, {x, y}, z)) continue;
      ++(std::isinf(z) ? filled.sky : filled.ground);
      map.depth.at<float>(y, x) = z;
      map.confidence.at<float>(y, x) = confidence;
      map.normal.at<cv::Vec3f>(y, x) = {normal.x(), normal.y(), normal.z()};
    }
  return filled;
}

}  // namespace

OpenSpace extend_over_ground(const std::vector<DepthView>& views, const LevelPlane& ground,
                             const std::vector<Eigen::Vector3f>& points, float far,
                             std::vector<DepthMap>& maps) {
  const int count = static_cast<int>(views.size());
  std::vector<cv::Mat> smooth(views.size()), known(views.size());
  std::vector<std::vector<Eigen::Vector3f>> raised(views.size());
  parallel_for(count, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    // What lies outside of the picture in memory is no picture.
    cv::blur(views[k].gray, smooth[k], {3, 3}, {-1, -1},
             cv::BORDER_REFLECT_101 | cv::BORDER_ISOLATED);
    known[k] = without_specks(maps[k].depth);
    raised[k] = raised_points(views[k], ground, known[k]);
  });
  std::vector<Eigen::Vector3f> raised_sparse;
  for (const Eigen::Vector3f& x : points)
    if (!on_ground(ground, x)) raised_sparse.push_back(x);
  raised.push_back(std::move(raised_sparse));
  const GrayRange levels = ground_levels(views, smooth, ground, known);
  std::vector<cv::Mat> wide(views.size()), narrow(views.size());
  parallel_for(count, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    const cv::Mat here = obstacles(views[k], raised, known[k].size());
    wide[k] = spread(here, reach_share);
    narrow[k] = spread(here, sky_reach_share);
  });
  const Witnesses witnesses(views, smooth, narrow);
  std::vector<OpenSpace> filled(views.size());
  parallel_for(count, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    const Panorama panorama(views[k].center(), ground, raised);
    Extension extension(views[k], ground, levels, smooth[k], wide[k], narrow[k], known[k],
                        maps[k].normal, panorama);
    const Eigen::Vector3f normal = views[k].world_rotation * ground.normal.cast<float>();
    filled[k] = fill(extension, witnesses, known[k], normal, far, k, maps[k]);
  });
  OpenSpace all;
  double pixels = 0;
  for (std::size_t k = 0; k < views.size(); ++k) {
    all.ground += filled[k].ground, all.sky += filled[k].sky;
    pixels += static_cast<double>(known[k].total());
  }
  if (pixels > 0) all.ground /= pixels, all.sky /= pixels;
  return all;
}

}  // namespace orbitfuse::depth
