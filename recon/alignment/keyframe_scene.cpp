// SPDX-License-Identifier: BSD-3-Clause
#include "recon/alignment/keyframe_scene.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>

#include "core/geometry/narrowed.hpp"
#include "core/numeric/angle_units.hpp"
#include "core/system/parallel.hpp"

namespace orbitfuse {
namespace {

constexpr float nothing = std::numeric_limits<float>::quiet_NaN();
/// Where a keyframe shows nothing it is drawn this many orbit radii away, so that what lies before
/// it keeps its outline.
constexpr double sky_radii = 30;

struct Keyframe {
  Camera camera;
  Rigid3d cam_from_world;
  cv::Mat1f brightness, depth;          ///< depth: everywhere finite
  std::vector<Eigen::Vector3f> points;  ///< of each pixel, in the camera
  cv::Mat1b whole;                      ///< pixels that begin a square of one surface
};

/// A vertex of a keyframe's surface in the camera that it is drawn for.
struct Vertex {
  float x = 0, y = 0, z = -1, value = 0;
};

/// Rows are cleared when something is drawn on them first: a band of a keyframe covers few.
struct Canvas {
  cv::Mat1f depth, brightness;
  std::vector<std::uint8_t> begun;

  explicit Canvas(const Camera& camera)
      : depth(camera.height, camera.width),
        brightness(camera.height, camera.width),
        begun(static_cast<std::size_t>(camera.height), 0) {}

  void begin_row(int y) {
    std::uint8_t& has_begun = begun[static_cast<std::size_t>(y)];
    if (has_begun != 0) return;
    has_begun = 1;
    std::fill_n(depth[y], depth.cols, std::numeric_limits<float>::infinity());
    std::fill_n(brightness[y], brightness.cols, nothing);
  }
};

float cross(const Vertex& a, const Vertex& b, float x, float y) {
  return (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x);
}

/// Pixels whose centres lie from `low` to `high`, of `count`; none where the last is before the
/// first. Clamped before they become integers: a vertex near the camera's plane is anywhere.
std::pair<int, int> pixels_between(float low, float high, int count) {
  const auto pixel = [&](float at) {
    return static_cast<int>(std::clamp(at, -1.0F, static_cast<float>(count)));
  };
  return {std::max(0, pixel(std::ceil(low - 0.5F))),
          std::min(count - 1, pixel(std::floor(high - 0.5F)))};
}

/// Front faces only: a surface says nothing about what it looks like from behind.
void draw_triangle(const Vertex& a, const Vertex& b, const Vertex& c, Canvas& canvas) {
  const auto [x0, x1] =
      pixels_between(std::min({a.x, b.x, c.x}), std::max({a.x, b.x, c.x}), canvas.depth.cols);
  const auto [y0, y1] =
      pixels_between(std::min({a.y, b.y, c.y}), std::max({a.y, b.y, c.y}), canvas.depth.rows);
  const float area = cross(a, b, c.x, c.y);
  if (x0 > x1 || y0 > y1 || !(area > 1e-9F)) return;
  for (int y = y0; y <= y1; ++y) {
    canvas.begin_row(y);
    for (int x = x0; x <= x1; ++x) {
      const float px = static_cast<float>(x) + 0.5F, py = static_cast<float>(y) + 0.5F;
      const float wa = cross(b, c, px, py), wb = cross(c, a, px, py), wc = cross(a, b, px, py);
      if (wa < 0 || wb < 0 || wc < 0) continue;
      const float z = (wa * a.z + wb * b.z + wc * c.z) / area;
      float& nearest = canvas.depth(y, x);
      if (!(z < nearest)) continue;
      nearest = z;
      canvas.brightness(y, x) = (wa * a.value + wb * b.value + wc * c.value) / area;
    }
  }
}

/// From a keyframe's camera to the pixels of the one that it is drawn for.
class Projection {
 public:
  Projection(const Keyframe& key, const Camera& camera, const Rigid3d& cam_from_world)
      : fx_(static_cast<float>(camera.fx)),
        fy_(static_cast<float>(camera.fy)),
        cx_(static_cast<float>(camera.cx)),
        cy_(static_cast<float>(camera.cy)) {
    const Rigid3d cam_from_key = cam_from_world * key.cam_from_world.inverse();
    rotation_ = cam_from_key.rotation.toRotationMatrix().cast<float>();
    translation_ = cam_from_key.translation.cast<float>();
  }
  /// z stays negative for what lies behind.
  Vertex vertex(const Eigen::Vector3f& in_key, float value) const {
    const Eigen::Vector3f p = rotation_ * in_key + translation_;
    if (!(p.z() > 1e-6F)) return {};
    return {fx_ * p.x() / p.z() + cx_, fy_ * p.y() / p.z() + cy_, p.z(), value};
  }

 private:
  float fx_, fy_, cx_, cy_;
  Eigen::Matrix3f rotation_;
  Eigen::Vector3f translation_;
};

/// A square of pixels, corners by rows.
void draw_square(const std::array<Vertex, 4>& corners, Canvas& canvas) {
  const auto& [a, b, c, d] = corners;
  if (a.z <= 0 || b.z <= 0 || c.z <= 0 || d.z <= 0) return;
  // Of keyframes finer than the canvas most squares lie between its pixels' centres.
  const auto [x0, x1] = pixels_between(std::min({a.x, b.x, c.x, d.x}),
                                       std::max({a.x, b.x, c.x, d.x}), canvas.depth.cols);
  if (x0 > x1) return;
  const auto [y0, y1] = pixels_between(std::min({a.y, b.y, c.y, d.y}),
                                       std::max({a.y, b.y, c.y, d.y}), canvas.depth.rows);
  if (y0 > y1) return;
  draw_triangle(a, b, d, canvas);
  draw_triangle(a, d, c, canvas);
}

/// A square that holds an outline: each of its four pixels reaches half-way across it, at its own
/// depth. Left out, outlines would lie half a pixel inside the object, all of them: it would look
/// smaller than it is, and cameras aligned with it would stand too near.
void draw_outline(const Keyframe& key, int x, int y, const Projection& projection, Canvas& canvas) {
  for (int v = 0; v <= 1; ++v)
    for (int u = 0; u <= 1; ++u) {
      const auto at = static_cast<std::size_t>((y + v) * key.depth.cols + x + u);
      const Eigen::Vector3f& point = key.points[at];
      const Eigen::Vector3f right(0.5F * point.z() / static_cast<float>(key.camera.fx), 0, 0);
      const Eigen::Vector3f down(0, 0.5F * point.z() / static_cast<float>(key.camera.fy), 0);
      const Eigen::Vector3f first =
          point - static_cast<float>(u) * right - static_cast<float>(v) * down;
      const float value = key.brightness.ptr<float>()[at];
      draw_square(
          {projection.vertex(first, value), projection.vertex(first + right, value),
           projection.vertex(first + down, value), projection.vertex(first + right + down, value)},
          canvas);
    }
}

/// The render as a surface.
Keyframe keyframe_of(const Camera& camera, const Rigid3d& cam_from_world, const SceneRender& seen,
                     double max_depth_step) {
  Keyframe key{camera, cam_from_world, seen.brightness, seen.depth, {}, {}};
  key.points.reserve(key.depth.total());
  for (int y = 0; y < key.depth.rows; ++y)
    for (int x = 0; x < key.depth.cols; ++x)
      key.points.push_back(camera.ray_of({x + 0.5, y + 0.5}).cast<float>() * key.depth(y, x));
  key.whole = cv::Mat1b(key.depth.size(), std::uint8_t{0});
  const auto step = static_cast<float>(1 + max_depth_step);
  for (int y = 0; y + 1 < key.depth.rows; ++y)
    for (int x = 0; x + 1 < key.depth.cols; ++x) {
      const float *upper = key.depth[y] + x, *lower = key.depth[y + 1] + x;
      const auto [near, far] = std::minmax({upper[0], upper[1], lower[0], lower[1]});
      key.whole(y, x) = far > near * step ? 0 : 1;
    }
  return key;
}

/// A keyframe is drawn in this many bands of its rows, whatever the number of threads.
constexpr int bands = 4;

Canvas drawn_band(const Keyframe& key, int band, const Camera& camera,
                  const Rigid3d& cam_from_world, bool outlines) {
  Canvas canvas(camera);
  const Projection projection(key, camera, cam_from_world);
  const int columns = key.depth.cols, squares = key.depth.rows - 1;
  const int first = squares * band / bands, last = squares * (band + 1) / bands;
  const auto row_of = [&](int y) {
    std::vector<Vertex> row;
    row.reserve(static_cast<std::size_t>(columns));
    const Eigen::Vector3f* points = &key.points[static_cast<std::size_t>(y * columns)];
    for (int x = 0; x < columns; ++x)
      row.push_back(projection.vertex(points[x], key.brightness(y, x)));
    return row;
  };
  std::vector<Vertex> upper, lower;
  if (first < last) lower = row_of(first);
  for (int y = first; y < last; ++y) {
    upper = std::move(lower);
    lower = row_of(y + 1);
    for (int x = 0; x + 1 < columns; ++x) {
      const auto i = static_cast<std::size_t>(x);
      if (key.whole(y, x) != 0)
        draw_square({upper[i], upper[i + 1], lower[i], lower[i + 1]}, canvas);
      else if (outlines)
        draw_outline(key, x, y, projection, canvas);
    }
  }
  return canvas;
}

/// What of `other` lies before what is drawn, nearer than `share` of its depth.
void draw_over(const Canvas& other, float share, Canvas& canvas) {
  for (int y = 0; y < canvas.depth.rows; ++y) {
    if (other.begun[static_cast<std::size_t>(y)] == 0) continue;
    canvas.begin_row(y);
    float *z = canvas.depth[y], *value = canvas.brightness[y];
    const float *other_z = other.depth[y], *other_value = other.brightness[y];
    for (int x = 0; x < canvas.depth.cols; ++x)
      if (other_z[x] < share * z[x]) z[x] = other_z[x], value[x] = other_value[x];
  }
}

/// Each keyframe's surface.
std::vector<Canvas> drawn(const std::vector<const Keyframe*>& keys, const Camera& camera,
                          const Rigid3d& cam_from_world) {
  std::vector<Canvas> all(keys.size() * bands, Canvas(Camera{}));
  // Of keyframes far away every slanted surface is a stair: its outlines would be edges.
  const bool outlines = keys.size() == 1;
  parallel_for(static_cast<int>(all.size()), [&](int i) {
    all[static_cast<std::size_t>(i)] = drawn_band(*keys[static_cast<std::size_t>(i / bands)],
                                                  i % bands, camera, cam_from_world, outlines);
  });
  std::vector<Canvas> layers;
  for (std::size_t k = 0; k < keys.size(); ++k) {
    layers.push_back(std::move(all[k * bands]));
    for (std::size_t band = 1; band < bands; ++band)
      draw_over(all[k * bands + band], 1, layers.back());
    for (int y = 0; y < camera.height; ++y) layers.back().begin_row(y);
  }
  return layers;
}

/// What no keyframe saw lies behind what hides it: a hole takes the farthest of the four surfaces
/// that it meets along its row and its column.
void fill_holes(Canvas& canvas) {
  const cv::Mat1f seen = canvas.depth.clone(), shade = canvas.brightness.clone();
  // Runs over the canvas in one direction, carrying the last surface met.
  const auto sweep = [&](int lines, int length, const auto& at) {
    for (int line = 0; line < lines; ++line) {
      float depth = 0, value = 0;
      for (int i = 0; i < length; ++i) {
        const cv::Point p = at(line, i);
        float& filled = canvas.depth(p);
        if (std::isfinite(seen(p))) {
          depth = seen(p), value = shade(p);
        } else if (depth > 0 && (!std::isfinite(filled) || depth > filled)) {
          filled = depth, canvas.brightness(p) = value;
        }
      }
    }
  };
  const int w = seen.cols, h = seen.rows;
  sweep(h, w, [](int y, int x) { return cv::Point(x, y); });
  sweep(h, w, [w](int y, int x) { return cv::Point(w - 1 - x, y); });
  sweep(w, h, [](int x, int y) { return cv::Point(x, y); });
  sweep(w, h, [h](int x, int y) { return cv::Point(x, h - 1 - y); });
}

class KeyframeScene {
 public:
  KeyframeScene(const SceneRenderer& renderer, Eigen::Vector3d center, KeyframeOptions options)
      : renderer_(renderer), center_(std::move(center)), options_(options) {}

  /// Renders the scene for a keyframe; `width` is that of the view without its margin.
  Status add(const Camera& camera, const Rigid3d& cam_from_world, int width, double margin_deg) {
    Camera wide = at_width(camera, width).without_distortion();
    const int margin = static_cast<int>(std::ceil(margin_deg * radians_per_degree * wide.fx));
    wide.width += 2 * margin, wide.height += 2 * margin;
    wide.cx += margin, wide.cy += margin;
    ORBITFUSE_ASSIGN(SceneRender seen, renderer_(wide, cam_from_world));
    const auto sky = static_cast<float>(sky_radii * distance(cam_from_world));
    for (float& z : cv::Mat1f(seen.depth))
      if (!(z > 0 && z < sky)) z = sky;
    keyframes_.push_back(keyframe_of(wide, cam_from_world, seen, options_.max_depth_step));
    return {};
  }

  Result<SceneRender> view(const Camera& camera, const Rigid3d& cam_from_world) {
    if (camera.width > options_.fine_width_px || camera.has_distortion())
      return renderer_(camera, cam_from_world);
    std::vector<const Keyframe*> used;
    if (camera.width <= options_.coarse_width_px && !keyframes_.empty()) {
      used = nearest(cam_from_world);
    } else {
      if (settled(camera, cam_from_world) == nullptr)
        ORBITFUSE_TRY(add(camera, cam_from_world, options_.fine_width_px, options_.max_turn_deg));
      used = {settled(camera, cam_from_world)};
    }
    return composed(used, camera, cam_from_world);
  }

 private:
  double distance(const Rigid3d& cam) const { return (camera_center(cam) - center_).norm(); }

  double apart_deg(const Rigid3d& a, const Rigid3d& b) const {
    const Eigen::Vector3d to_a = camera_center(a) - center_, to_b = camera_center(b) - center_;
    return std::atan2(to_a.cross(to_b).norm(), to_a.dot(to_b)) / radians_per_degree;
  }

  std::vector<const Keyframe*> nearest(const Rigid3d& cam_from_world) const {
    std::vector<const Keyframe*> all;
    for (const Keyframe& key : keyframes_) all.push_back(&key);
    const auto away = [&](const Keyframe* key) {
      return apart_deg(key->cam_from_world, cam_from_world);
    };
    const auto count =
        std::min<std::size_t>(all.size(), static_cast<std::size_t>(options_.coarse_keyframes));
    std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count), all.end(),
                      [&](const Keyframe* a, const Keyframe* b) { return away(a) < away(b); });
    all.resize(count);
    return all;
  }

  /// The nearest keyframe that shows all that the camera sees, from where it stands but for little.
  const Keyframe* settled(const Camera& camera, const Rigid3d& cam) const {
    const Keyframe* best = nullptr;
    double least = options_.max_turn_deg * (1 + 1e-9);
    for (const Keyframe& key : keyframes_) {
      const double finer = key.camera.fx / camera.fx;
      const double wide = (key.camera.width / key.camera.fx) / (camera.width / camera.fx);
      if (finer < 0.97 || wide < 1) continue;
      const double turned = std::max(apart_deg(key.cam_from_world, cam),
                                     rotation_angle_deg(key.cam_from_world.rotation, cam.rotation));
      const double nearer = std::abs(std::log(distance(cam) / distance(key.cam_from_world)));
      if (turned > least || nearer > options_.max_distance_change) continue;
      best = &key, least = turned;
    }
    return best;
  }

  Result<SceneRender> composed(const std::vector<const Keyframe*>& used, const Camera& camera,
                               const Rigid3d& cam_from_world) const {
    std::vector<Canvas> layers = drawn(used, camera, cam_from_world);
    Canvas& all = layers.front();
    // The nearest keyframe has the word; another one only where it sees something clearly before.
    for (std::size_t k = 1; k < layers.size(); ++k)
      draw_over(layers[k], static_cast<float>(1 - options_.max_depth_step), all);
    fill_holes(all);
    const auto sky = static_cast<float>(0.3 * sky_radii * distance(cam_from_world));
    for (float& z : all.depth)
      if (!(z < sky)) z = nothing;
    return SceneRender{all.brightness, all.depth};
  }

  const SceneRenderer& renderer_;
  Eigen::Vector3d center_;
  KeyframeOptions options_;
  std::vector<Keyframe> keyframes_;
};

}  // namespace

Result<SceneRenderer> keyframe_scene(const SceneRenderer& renderer,
                                     const std::vector<PosedView>& views,
                                     const Eigen::Vector3d& center, const KeyframeOptions& options,
                                     const Progress& progress) {
  const auto scene = std::make_shared<KeyframeScene>(renderer, center, options);
  for (const PosedView& view : views) {
    ORBITFUSE_TRY(progress.check("poses.thermal"));
    ORBITFUSE_TRY(scene->add(view.camera, view.cam_from_world, options.first_width_px, 0));
  }
  return [scene](const Camera& camera, const Rigid3d& cam_from_world) {
    return scene->view(camera, cam_from_world);
  };
}

}  // namespace orbitfuse
