// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/edge_lines.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "core/geometry/nearest_to_lines.hpp"
#include "core/numeric/angle_units.hpp"
#include "core/system/parallel.hpp"
#include "recon/alignment/luminance.hpp"

namespace orbitfuse {
namespace {

/// First ends of eight segments side by side; of those that aren't there or have no direction, far
/// away.
struct SegmentGroup {
  static constexpr std::size_t size = 8;
  using Array = Eigen::Array<double, size, 1>;
  Array x = Array::Constant(1e30), y = Array::Constant(1e30);
};

bool has_direction(const ImageSegment& segment) {
  return segment.a.allFinite() && segment.b.allFinite() && segment.a != segment.b;
}

/// A view's segments with what matching asks of them again and again.
struct LineView {
  Eigen::Vector3d center;
  Rigid3d cam_from_world;
  double focal_px = 1;
  double near = 0, far = 0;  ///< depths of its sparse surroundings
  const std::vector<ImageSegment>* segments = nullptr;
  std::vector<Eigen::Vector3d> plane;  ///< unit world normal of the plane through each segment
  std::vector<SegmentGroup> groups;
};

struct Hypothesis {
  Eigen::Vector3d a, b;
  int view = 0, segment = 0;
  std::vector<std::pair<int, int>> support;  ///< (view, segment), the own one included
  double length_px = 0;
};

Eigen::Vector3d ray(const LineView& view, const Eigen::Vector2d& p) {
  return view.cam_from_world.rotation.conjugate() * Eigen::Vector3d(p.x(), p.y(), 1.0);
}

/// Depth (z in the view) at which a pixel's ray meets a world plane; NaN when nearly parallel.
double depth_on_plane(const LineView& view, const Eigen::Vector3d& d, const Eigen::Vector3d& point,
                      const Eigen::Vector3d& normal) {
  const double across = normal.dot(d);
  if (std::abs(across) < 0.04 * d.norm()) return std::nan("");
  return normal.dot(point - view.center) / across;
}

/// The segment of `view` that the world line a-b falls on, or -1.
int matching_segment(const LineView& view, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                     const EdgeLineOptions& options) {
  const Eigen::Vector3d ac = view.cam_from_world * a, bc = view.cam_from_world * b;
  if (ac.z() <= 1e-6 || bc.z() <= 1e-6) return -1;
  const Eigen::Vector2d pa = ac.head<2>() / ac.z(), pb = bc.head<2>() / bc.z();
  const double length = (pb - pa).norm();
  if (length * view.focal_px < 6) return -1;
  const Eigen::Vector2d along = (pb - pa) / length;
  const double max_sine = std::sin(options.max_angle_deg * radians_per_degree);
  int best = -1;
  double best_distance = options.max_distance_px / view.focal_px;
  const auto try_segment = [&](std::size_t s) {
    const ImageSegment& segment = (*view.segments)[s];
    if (!has_direction(segment)) return;
    const Eigen::Vector2d toward = segment.a - pa, other = segment.b - pa;
    const double da = along.x() * toward.y() - along.y() * toward.x();
    const double db = along.x() * other.y() - along.y() * other.x();
    const double distance = std::max(std::abs(da), std::abs(db));
    if (distance >= best_distance) return;
    const Eigen::Vector2d span = segment.b - segment.a;
    const double own = span.norm();
    if (std::abs(along.x() * span.y() - along.y() * span.x()) > max_sine * own) return;
    const double ta = along.dot(toward), tb = along.dot(other);
    const double overlap = std::min(length, std::max(ta, tb)) - std::max(0.0, std::min(ta, tb));
    if (overlap < 0.5 * std::min(length, own)) return;
    best = static_cast<int>(s);
    best_distance = distance;
  };
  // Few of hundreds of segments begin near the line: eight are passed over at once.
  for (std::size_t g = 0; g < view.groups.size(); ++g) {
    const SegmentGroup::Array away =
        along.x() * (view.groups[g].y - pa.y()) - along.y() * (view.groups[g].x - pa.x());
    if (away.abs().minCoeff() >= best_distance) continue;
    const std::size_t first = g * SegmentGroup::size;
    for (std::size_t s = first; s < std::min(view.segments->size(), first + SegmentGroup::size);
         ++s)
      try_segment(s);
  }
  return best;
}

std::vector<int> neighbours(const std::vector<LineView>& views, int index,
                            const Eigen::Vector3d& focus, double max_angle_deg) {
  std::vector<std::pair<double, int>> by_angle;
  const Eigen::Vector3d own = (views[static_cast<std::size_t>(index)].center - focus).normalized();
  for (std::size_t j = 0; j < views.size(); ++j) {
    const double angle =
        std::acos(std::clamp(own.dot((views[j].center - focus).normalized()), -1.0, 1.0)) /
        radians_per_degree;
    if (static_cast<int>(j) != index && angle > 3 && angle < max_angle_deg)
      by_angle.emplace_back(angle, static_cast<int>(j));
  }
  std::sort(by_angle.begin(), by_angle.end());
  std::vector<int> result;
  for (const auto& [angle, j] : by_angle) result.push_back(j);
  return result;
}

/// The best supported line through one segment, or none.
std::optional<Hypothesis> best_line(const std::vector<LineView>& views, int v, int s,
                                    const std::vector<int>& near_views,
                                    const EdgeLineOptions& options) {
  const LineView& view = views[static_cast<std::size_t>(v)];
  const ImageSegment& segment = (*view.segments)[static_cast<std::size_t>(s)];
  const std::size_t partners = std::min<std::size_t>(near_views.size(), 4);
  const std::size_t witnesses = std::min<std::size_t>(near_views.size(), 10);
  if (!has_direction(segment)) return std::nullopt;
  const Eigen::Vector3d ray_a = ray(view, segment.a), ray_b = ray(view, segment.b);
  std::optional<Hypothesis> best;
  for (std::size_t n = 0; n < partners; ++n) {
    const int j = near_views[n];
    const LineView& other = views[static_cast<std::size_t>(j)];
    for (std::size_t t = 0; t < other.segments->size(); ++t) {
      const double za = depth_on_plane(view, ray_a, other.center, other.plane[t]);
      const double zb = depth_on_plane(view, ray_b, other.center, other.plane[t]);
      if (!(za > view.near && za < view.far && zb > view.near && zb < view.far)) continue;
      const Eigen::Vector3d a = view.center + za * ray_a;
      const Eigen::Vector3d b = view.center + zb * ray_b;
      // The planes meet everywhere along the line: the two segments must also overlap on it.
      const Eigen::Vector3d ac = other.cam_from_world * a, bc = other.cam_from_world * b;
      if (ac.z() <= 1e-6 || bc.z() <= 1e-6) continue;
      const ImageSegment& match = (*other.segments)[t];
      const Eigen::Vector2d along = (match.b - match.a).normalized();
      const double length = (match.b - match.a).norm();
      const double ta = along.dot(ac.head<2>() / ac.z() - match.a);
      const double tb = along.dot(bc.head<2>() / bc.z() - match.a);
      const double overlap = std::min(length, std::max(ta, tb)) - std::max(0.0, std::min(ta, tb));
      if (overlap < 0.5 * std::min(length, std::abs(tb - ta))) continue;

      Hypothesis line{a, b, v, s, {{v, s}, {j, static_cast<int>(t)}}, segment.length_px};
      const std::size_t wanted = std::max<std::size_t>(static_cast<std::size_t>(options.min_views),
                                                       best ? best->support.size() + 1 : 0);
      for (std::size_t w = 0; w < witnesses && line.support.size() + witnesses - w >= wanted; ++w) {
        if (near_views[w] == j) continue;
        const int found =
            matching_segment(views[static_cast<std::size_t>(near_views[w])], a, b, options);
        if (found >= 0) line.support.emplace_back(near_views[w], found);
      }
      if (line.support.size() >= wanted) best = std::move(line);
    }
  }
  return best;
}

/// Moves the ends along their rays to the least-squares crossing of all supporting planes.
void refine(Hypothesis& line, const std::vector<LineView>& views) {
  const LineView& view = views[static_cast<std::size_t>(line.view)];
  for (Eigen::Vector3d* end : {&line.a, &line.b}) {
    const Eigen::Vector3d d = (*end - view.center).normalized();
    double numerator = 0, denominator = 0;
    for (const auto& [k, segment] : line.support) {
      if (k == line.view) continue;
      const LineView& other = views[static_cast<std::size_t>(k)];
      const Eigen::Vector3d& n = other.plane[static_cast<std::size_t>(segment)];
      const double weight = 1.0 / (*end - other.center).squaredNorm();
      numerator += weight * n.dot(d) * n.dot(other.center - view.center);
      denominator += weight * n.dot(d) * n.dot(d);
    }
    if (denominator > 0 && numerator > 0) *end = view.center + numerator / denominator * d;
  }
}

}  // namespace

std::vector<ImageSegment> detect_segments(const cv::Mat& gray, const Camera& camera,
                                          const EdgeLineOptions& options) {
  cv::Mat image = gray;
  double scale = 1.0;
  const int side = std::max(gray.cols, gray.rows);
  if (side > options.max_image_side_px) {
    scale = static_cast<double>(options.max_image_side_px) / side;
    cv::resize(gray, image, {}, scale, scale, cv::INTER_AREA);
  }
  std::vector<cv::Vec4f> found;
  cv::createLineSegmentDetector(cv::LSD_REFINE_STD)->detect(image, found);
  std::vector<ImageSegment> segments;
  for (const cv::Vec4f& f : found) {
    // LSD counts from the corner pixel's centre; Camera from its corner.
    const Eigen::Vector2d a(f[0] + 0.5, f[1] + 0.5), b(f[2] + 0.5, f[3] + 0.5);
    const double length = (b - a).norm();
    if (length < options.min_length_px) continue;
    ImageSegment segment{camera.normalized_of(a / scale), camera.normalized_of(b / scale), length};
    if (segment.a.allFinite() && segment.b.allFinite()) segments.push_back(segment);
  }
  std::stable_sort(segments.begin(), segments.end(),
                   [](const auto& x, const auto& y) { return x.length_px > y.length_px; });
  if (static_cast<int>(segments.size()) > options.max_segments_per_view)
    segments.resize(static_cast<std::size_t>(options.max_segments_per_view));
  return segments;
}

std::vector<EdgeLine> triangulate_lines(const std::vector<PosedView>& posed,
                                        const std::vector<std::vector<ImageSegment>>& segments,
                                        const EdgeLineOptions& options) {
  std::vector<LineView> views;
  std::vector<double> distances;
  NearestToLines axes;
  for (const PosedView& p : posed)
    axes.add(camera_center(p.cam_from_world),
             p.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ());
  // Axes that meet nowhere: any finite distance, the lines that it leaves are checked.
  const Eigen::Vector3d focus =
      axes.crossing() > 1e-9 ? axes.point() : Eigen::Vector3d(Eigen::Vector3d::Zero());
  for (std::size_t v = 0; v < posed.size(); ++v) {
    LineView view;
    view.cam_from_world = posed[v].cam_from_world;
    view.center = camera_center(view.cam_from_world);
    view.focal_px = posed[v].camera.fx *
                    std::min(1.0, static_cast<double>(options.max_image_side_px) /
                                      std::max(posed[v].camera.width, posed[v].camera.height));
    const double distance = (view.center - focus).norm();
    view.near = 0.15 * distance, view.far = 3.0 * distance;
    view.segments = &segments[v];
    for (const ImageSegment& s : segments[v]) {
      const auto in_group = static_cast<Eigen::Index>(view.plane.size() % SegmentGroup::size);
      if (in_group == 0) view.groups.emplace_back();
      if (has_direction(s))
        view.groups.back().x[in_group] = s.a.x(), view.groups.back().y[in_group] = s.a.y();
      view.plane.push_back(ray(view, s.a).cross(ray(view, s.b)).normalized());
    }
    views.push_back(std::move(view));
  }

  std::vector<std::vector<Hypothesis>> found(views.size());
  parallel_for(static_cast<int>(views.size()), [&](int v) {
    const std::vector<int> near_views = neighbours(views, v, focus, options.max_view_angle_deg);
    const auto count = static_cast<int>(segments[static_cast<std::size_t>(v)].size());
    for (int s = 0; s < count; ++s)
      if (auto line = best_line(views, v, s, near_views, options))
        found[static_cast<std::size_t>(v)].push_back(std::move(*line));
  });

  std::vector<Hypothesis> all;
  for (auto& list : found) std::move(list.begin(), list.end(), std::back_inserter(all));
  std::stable_sort(all.begin(), all.end(), [](const Hypothesis& x, const Hypothesis& y) {
    return std::pair(x.support.size(), x.length_px) > std::pair(y.support.size(), y.length_px);
  });
  std::vector<std::vector<bool>> used;
  for (const auto& list : segments) used.emplace_back(list.size(), false);
  std::vector<EdgeLine> lines;
  for (Hypothesis& line : all) {
    if (used[static_cast<std::size_t>(line.view)][static_cast<std::size_t>(line.segment)]) continue;
    refine(line, views);
    EdgeLine result{line.a, line.b, {}};
    for (const auto& [v, s] : line.support) {
      used[static_cast<std::size_t>(v)][static_cast<std::size_t>(s)] = true;
      result.views.push_back(v);
    }
    std::sort(result.views.begin(), result.views.end());
    lines.push_back(std::move(result));
  }
  return lines;
}

namespace {

Result<std::vector<ImageSegment>> segments_of(const Session& session, const PosedView& view,
                                              const EdgeLineOptions& options) {
  const auto frame = std::find_if(session.frames.begin(), session.frames.end(),
                                  [&](const FrameRecord& f) { return f.file == view.name; });
  if (frame == session.frames.end())
    return fail(ErrorKind::input, view.name, "a posed view that the session does not have",
                "run the visible poses again");
  ORBITFUSE_ASSIGN(const cv::Mat values, read_luminance(session, *frame));
  cv::Mat gray;
  values.convertTo(gray, CV_8U);
  return detect_segments(gray, view.camera, options);
}

}  // namespace

Result<std::vector<EdgeLine>> visible_edge_lines(const Session& session,
                                                 const Reconstruction& visible,
                                                 const EdgeLineOptions& options,
                                                 const Progress& progress) {
  std::vector<std::vector<ImageSegment>> segments(visible.views.size());
  std::vector<Status> found(visible.views.size());
  parallel_for(static_cast<int>(visible.views.size()), [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    found[i] = progress.check("poses.thermal");
    if (!found[i]) return;
    auto of_view = segments_of(session, visible.views[i], options);
    if (of_view)
      segments[i] = std::move(*of_view);
    else
      found[i] = tl::unexpected(of_view.error());
  });
  for (const Status& one : found) ORBITFUSE_TRY(one);
  return triangulate_lines(visible.views, segments, options);
}

}  // namespace orbitfuse
