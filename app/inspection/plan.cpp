// SPDX-License-Identifier: BSD-3-Clause
#include "app/inspection/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "app/report/html.hpp"

namespace orbitfuse::inspection {
namespace {
using view::FinishedRun;
using view::RecordedView;

constexpr int size_px = 760;     // of the drawing, square
constexpr double margin = 0.12;  // beyond what is shown, of its reach

/// From the world to the page: seen along the orbit's up direction, the page's up is one of the
/// world's axes. `reach` from `center` is half the page.
class Projection {
 public:
  Projection(const Eigen::Vector3d& center, const Eigen::Vector3d& up, double reach)
      : center_(center), up_(up.normalized()), reach_(reach) {
    Eigen::Vector3d ahead = Eigen::Vector3d::UnitY();
    if (std::abs(up_.dot(ahead)) > 0.9) ahead = Eigen::Vector3d::UnitX();
    right_ = ahead.cross(up_).normalized();
    ahead_ = up_.cross(right_);
  }
  Eigen::Vector2d page(const Eigen::Vector3d& p) const {
    const Eigen::Vector2d f = flat(p);
    return {(0.5 + 0.5 * f.x() / reach_) * size_px, (0.5 - 0.5 * f.y() / reach_) * size_px};
  }
  Eigen::Vector2d direction(const Eigen::Vector3d& d) const {
    const Eigen::Vector2d f(right_.dot(d), -ahead_.dot(d));
    return f.norm() > 1e-9 ? Eigen::Vector2d(f.normalized()) : Eigen::Vector2d(0, 0);
  }
  double height(const Eigen::Vector3d& p) const { return up_.dot(p - center_); }
  /// How far a point is from the middle of the page, in world units.
  double off(const Eigen::Vector3d& p) const { return flat(p).cwiseAbs().maxCoeff(); }
  double reach() const { return reach_; }

 private:
  Eigen::Vector2d flat(const Eigen::Vector3d& p) const {
    return {right_.dot(p - center_), ahead_.dot(p - center_)};
  }
  Eigen::Vector3d center_, up_, right_, ahead_;
  double reach_ = 1;
};

/// All cameras.
Projection overview(const FinishedRun& run) {
  const Projection unit(run.center, run.up, 1);
  double reach = run.radius;
  for (const RecordedView& v : run.views) {
    const double far = unit.off(camera_center(v.view.cam_from_world));
    if (std::isfinite(far)) reach = std::max(reach, far);
  }
  return {run.center, run.up, (1 + margin) * reach};
}

/// The findings alone, where they lie close together on the overview.
std::optional<Projection> close_up(const FinishedRun& run, const std::vector<PlanMark>& marks,
                                   double overview_reach) {
  if (marks.empty()) return std::nullopt;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const PlanMark& mark : marks) middle += mark.position / static_cast<double>(marks.size());
  const Projection unit(middle, run.up, 1);
  double reach = 0.3 * run.radius;
  for (const PlanMark& mark : marks) reach = std::max(reach, 1.4 * unit.off(mark.position));
  if (!(reach < 0.5 * overview_reach)) return std::nullopt;
  return Projection(middle, run.up, reach);
}

/// The surface from above, the highest point last.
cv::Mat surface_picture(const FinishedRun& run, const Projection& projection, int splat_px) {
  cv::Mat picture(size_px, size_px, CV_8UC3, cv::Scalar(255, 255, 255));
  const PointCloud& cloud = run.surface;
  if (cloud.colors.empty()) return picture;
  double highest = 0;
  for (const RecordedView& v : run.views)
    highest = std::max(highest, projection.height(camera_center(v.view.cam_from_world)));
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const double height = projection.height(cloud.positions[i]);
    // What floats above the cameras hides what they went round.
    if (height <= highest) order.emplace_back(height, i);
  }
  std::sort(order.begin(), order.end());
  for (const auto& [height, i] : order) {
    const Eigen::Vector2d p = projection.page(cloud.positions[i]);
    if (!(p.x() > -splat_px && p.y() > -splat_px && p.x() < size_px && p.y() < size_px)) continue;
    const auto& c = cloud.colors[i];
    const cv::Rect splat(static_cast<int>(p.x()), static_cast<int>(p.y()), splat_px, splat_px);
    // Paler than it is: the drawing lies over it.
    const auto pale = [](std::uint8_t level) { return 96 + 159.0 * level / 255; };
    picture(splat & cv::Rect(0, 0, size_px, size_px))
        .setTo(cv::Scalar(pale(c[2]), pale(c[1]), pale(c[0])));
  }
  return picture;
}

std::string camera_mark(const RecordedView& v, const Projection& projection) {
  const Eigen::Vector2d at = projection.page(camera_center(v.view.cam_from_world));
  if (!at.allFinite()) return {};
  const Eigen::Vector2d look =
      at + 22 * projection.direction(v.view.cam_from_world.rotation.conjugate() *
                                     Eigen::Vector3d::UnitZ());
  const bool visible = v.modality == Modality::visible;
  const char* color = visible ? "#1f5fbf" : "#c65a00";
  std::string svg = fmt::format(
      "<g stroke=\"{0}\" stroke-width=\"2\"><title>{1}{2}</title><line x1=\"{3:.1f}\" "
      "y1=\"{4:.1f}\" "
      "x2=\"{5:.1f}\" y2=\"{6:.1f}\"/>",
      color, report::escape(v.view.name), v.doubt ? ": doubtful" : "", at.x(), at.y(), look.x(),
      look.y());
  if (visible)
    svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"5\" fill=\"{}\"/>", at.x(), at.y(),
                       color);
  else
    svg += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"9\" height=\"9\" fill=\"{}\"/>",
                       at.x() - 4.5, at.y() - 4.5, color);
  if (v.doubt)
    svg += fmt::format(
        "<path d=\"M{0:.1f} {1:.1f}L{2:.1f} {3:.1f}M{0:.1f} {3:.1f}L{2:.1f} {1:.1f}\" "
        "stroke=\"#000\" stroke-width=\"2.5\"/>",
        at.x() - 9, at.y() - 9, at.x() + 9, at.y() + 9);
  return svg + "</g>\n";
}

std::string sight_line(const PlanMark& mark, const FinishedRun& run, const Projection& projection) {
  const Eigen::Vector2d at = projection.page(mark.position);
  for (const RecordedView& v : run.views) {
    const Eigen::Vector2d from = projection.page(camera_center(v.view.cam_from_world));
    if (v.view.name == mark.view && from.allFinite())
      return fmt::format(
          "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#b3001e\" "
          "stroke-width=\"2\" stroke-dasharray=\"6 5\"/>\n",
          from.x(), from.y(), at.x(), at.y());
  }
  return {};
}

std::string finding_mark(const PlanMark& mark, const Projection& projection, bool numbered) {
  const Eigen::Vector2d at = projection.page(mark.position);
  if (!numbered)
    return fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"6\" fill=\"#b3001e\"/>\n", at.x(),
                       at.y());
  return fmt::format(
      "<circle cx=\"{0:.1f}\" cy=\"{1:.1f}\" r=\"22\" fill=\"#b3001e\" stroke=\"#fff\" "
      "stroke-width=\"3\"/><text x=\"{0:.1f}\" y=\"{2:.1f}\" text-anchor=\"middle\" "
      "font-size=\"27\" font-weight=\"700\" fill=\"#fff\">{3}</text>\n",
      at.x(), at.y(), at.y() + 9.5, mark.number);
}

std::string drawing(const FinishedRun& run, const std::vector<PlanMark>& marks,
                    const Projection& projection, int splat_px, bool numbered,
                    const char* caption) {
  std::string svg = fmt::format(
      "<figure><svg class=\"plan\" viewBox=\"0 0 {0} {0}\" role=\"img\" aria-label=\"{2}\" "
      "font-family=\"sans-serif\">\n<image href=\"{1}\" width=\"{0}\" height=\"{0}\"/>\n",
      size_px, report::data_uri(surface_picture(run, projection, splat_px), size_px, 85), caption);
  for (const PlanMark& mark : marks) svg += sight_line(mark, run, projection);
  for (const RecordedView& v : run.views) svg += camera_mark(v, projection);
  // Places that lie over each other from above: the earlier finding stays on top.
  for (auto mark = marks.rbegin(); mark != marks.rend(); ++mark)
    svg += finding_mark(*mark, projection, numbered);
  return svg + fmt::format("</svg><figcaption>{}</figcaption></figure>\n", caption);
}

}  // namespace

std::string plan_svg(const FinishedRun& run, const std::vector<PlanMark>& all) {
  std::vector<PlanMark> marks;
  for (const PlanMark& mark : all)
    if (mark.position.allFinite()) marks.push_back(mark);
  const Projection whole = overview(run);
  const auto near = close_up(run, marks, whole.reach());
  constexpr int splat_px = 3, widest_splat_px = 12;  // of a point of the surface
  std::string html = "<div class=\"plans\">" +
                     drawing(run, marks, whole, splat_px, !near, "All views and findings");
  if (near) {
    const auto wider = static_cast<int>(std::lround(splat_px * whole.reach() / near->reach()));
    html += drawing(run, marks, *near, std::min(wider, widest_splat_px), true, "The findings");
  }
  return html + "</div>\n";
}

}  // namespace orbitfuse::inspection
