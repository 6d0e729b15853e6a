// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/exposure.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "core/median.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr float darkest = 0.04f, brightest = 0.96f;  ///< beyond, a sample is noise or clipped
constexpr int enough_per_view = 50;
constexpr double usual = 0.03;  ///< residual of log samples: their noise and shading
constexpr float unknown = std::numeric_limits<float>::quiet_NaN();

struct Sample {
  int view;
  Eigen::Array3f log_value;  ///< NaN where dark or clipped
};

/// A place in the world with what training views show of it.
struct Sight {
  Eigen::Vector3d position;
  std::vector<Sample> samples;
};

using Sights = std::vector<Sight>;

class Images {
 public:
  explicit Images(const Dataset& data) : data_(data), smooth_(data.views.size()) {}

  /// Mean of 3x3 pixels round `pixel`; false outside the image.
  bool at(int view, const Eigen::Vector2d& pixel, Eigen::Array3f& log_value) {
    cv::Mat& image = smooth_[static_cast<std::size_t>(view)];
    if (image.empty()) cv::blur(data_.views[static_cast<std::size_t>(view)].image, image, {3, 3});
    if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < image.cols && pixel.y() < image.rows)) return false;
    const auto& rgb = image.at<cv::Vec3f>(static_cast<int>(pixel.y()), static_cast<int>(pixel.x()));
    for (int c = 0; c < 3; ++c)
      log_value[c] = rgb[c] > darkest && rgb[c] < brightest ? std::log(rgb[c]) : unknown;
    return true;
  }

  bool seen_at(int view, const Eigen::Vector3d& world, Eigen::Array3f& log_value) {
    const TrainingView& v = data_.views[static_cast<std::size_t>(view)];
    const Eigen::Vector3d p = v.cam_from_world * world;
    return p.z() > 0 && at(view, v.camera.project(p), log_value);
  }

 private:
  const Dataset& data_;
  std::vector<cv::Mat> smooth_;
};

Sights sights_of_tracks(const Dataset& data, const std::vector<bool>& heldout, Images& images) {
  Sights sights;
  for (const SparsePoint& point : data.points) {
    Sight sight{point.position, {}};
    for (const Observation& seen : point.track) {
      Sample sample{seen.view, {}};
      if (!heldout[static_cast<std::size_t>(seen.view)] && images.at(seen.view, seen.pixel, sample.log_value))
        sight.samples.push_back(sample);
    }
    if (sight.samples.size() > 1) sights.push_back(std::move(sight));
  }
  return sights;
}

/// Points of the depth maps that other maps confirm within 1 %.
void add_sights_of_depth(const Dataset& data, const std::vector<bool>& heldout, Images& images, Sights& sights) {
  const auto confirms = [&](const DepthMap& map, const Eigen::Vector3d& world) {
    const Eigen::Vector3d p = data.views[static_cast<std::size_t>(map.view)].cam_from_world * world;
    if (!(p.z() > 0)) return false;
    const Eigen::Vector2d pixel = map.camera.project(p);
    if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < map.depth.cols && pixel.y() < map.depth.rows)) return false;
    const float z = map.depth.at<float>(static_cast<int>(pixel.y()), static_cast<int>(pixel.x()));
    return std::abs(z - p.z()) < 0.01 * p.z();
  };
  const double maps = static_cast<double>(data.depth.size());
  const double per_map = std::clamp(4e6 / (maps * maps), 50.0, 1000.0);
  for (const DepthMap& map : data.depth) {
    if (heldout[static_cast<std::size_t>(map.view)]) continue;
    const Rigid3d world_from_cam = data.views[static_cast<std::size_t>(map.view)].cam_from_world.inverse();
    const int step = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(map.depth.total()) / per_map)));
    for (int y = step / 2; y < map.depth.rows; y += step)
      for (int x = step / 2; x < map.depth.cols; x += step) {
        const float z = map.depth.at<float>(y, x);
        if (!std::isfinite(z)) continue;
        const Eigen::Vector2d at = map.camera.normalized_of({x + 0.5, y + 0.5});
        Sight sight{world_from_cam * (double{z} * Eigen::Vector3d(at.x(), at.y(), 1)), {}};
        for (const DepthMap& other : data.depth) {
          Sample sample{other.view, {}};
          if (!heldout[static_cast<std::size_t>(other.view)] && (&other == &map || confirms(other, sight.position)) &&
              images.seen_at(other.view, sight.position, sample.log_value))
            sight.samples.push_back(sample);
        }
        if (sight.samples.size() > 1) sights.push_back(std::move(sight));
      }
  }
}

bool too_few(const Sights& sights, const std::vector<bool>& heldout) {
  std::vector<int> counts(heldout.size(), 0);
  for (const Sight& sight : sights)
    for (const Sample& sample : sight.samples) ++counts[static_cast<std::size_t>(sample.view)];
  for (std::size_t i = 0; i < counts.size(); ++i)
    if (!heldout[i] && counts[i] < enough_per_view) return true;
  return false;
}

struct ChannelFit {
  Eigen::VectorXd gain;          ///< per view
  std::vector<double> of_sight;  ///< NaN: fewer than two views show this channel
};

/// Points are eliminated, so each turn solves a system of the views alone.
ChannelFit fit_channel(const Sights& sights, std::size_t views, int channel) {
  const auto size = static_cast<Eigen::Index>(views);
  ChannelFit fit{Eigen::VectorXd::Zero(size), std::vector<double>(sights.size(), unknown)};
  constexpr double prior = 1e-2;  // a view that nothing ties to the others has no gain
  struct Weighed {
    int view;
    double value, weight;
  };
  std::vector<std::vector<Weighed>> used(sights.size());
  for (std::size_t p = 0; p < sights.size(); ++p)
    for (const Sample& s : sights[p].samples)
      if (std::isfinite(s.log_value[channel])) used[p].push_back({s.view, s.log_value[channel], 1});
  for (int turn = 0; turn < 12; ++turn) {
    Eigen::MatrixXd normal = prior * Eigen::MatrixXd::Identity(size, size);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
    for (const std::vector<Weighed>& samples : used) {
      if (samples.size() < 2) continue;
      double total = 0, mean = 0;
      for (const Weighed& s : samples) total += s.weight;
      for (const Weighed& s : samples) mean += s.weight * s.value / total;
      for (const Weighed& s : samples) {
        right[s.view] += s.weight * (s.value - mean);
        normal(s.view, s.view) += s.weight;
        for (const Weighed& o : samples) normal(s.view, o.view) -= s.weight * o.weight / total;
      }
    }
    fit.gain = normal.ldlt().solve(right);
    for (std::size_t p = 0; p < sights.size(); ++p) {
      if (used[p].size() < 2) continue;
      double total = 0, mean = 0;
      for (const Weighed& s : used[p]) {
        total += s.weight;
        mean += s.weight * (s.value - fit.gain[s.view]);
      }
      fit.of_sight[p] = mean / total;
      for (Weighed& s : used[p]) {
        const double residual = s.value - fit.gain[s.view] - fit.of_sight[p];
        s.weight = std::pow(usual / std::max(usual, std::abs(residual)), 2);  // wrong matches count for nothing
      }
    }
  }
  return fit;
}

/// The two training views that look most alike.
std::vector<int> nearest_views(const Dataset& data, const std::vector<bool>& heldout, std::size_t view) {
  const auto axis = [&](std::size_t i) -> Eigen::Vector3d {
    return data.views[i].cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ();
  };
  std::vector<int> others;
  for (std::size_t i = 0; i < heldout.size(); ++i)
    if (!heldout[i]) others.push_back(static_cast<int>(i));
  const auto count = std::min<std::size_t>(2, others.size());
  std::partial_sort(others.begin(), others.begin() + static_cast<std::ptrdiff_t>(count), others.end(), [&](int a, int b) {
    return axis(static_cast<std::size_t>(a)).dot(axis(view)) > axis(static_cast<std::size_t>(b)).dot(axis(view));
  });
  others.resize(count);
  return others;
}

}  // namespace

Exposure estimate_exposure(const Dataset& data, const std::vector<bool>& heldout) {
  Exposure exposure;
  exposure.log_gain.assign(data.views.size(), Eigen::Array3d::Zero());
  Images images(data);
  Sights sights = sights_of_tracks(data, heldout, images);
  if (too_few(sights, heldout)) add_sights_of_depth(data, heldout, images, sights);
  exposure.points = static_cast<int>(sights.size());
  const auto training = static_cast<double>(std::count(heldout.begin(), heldout.end(), false));
  double squares = 0;
  for (int c = 0; c < 3; ++c) {
    ChannelFit fit = fit_channel(sights, data.views.size(), c);
    double mean = 0;
    for (std::size_t i = 0; i < heldout.size(); ++i)
      if (!heldout[i]) mean += fit.gain[static_cast<Eigen::Index>(i)] / training;
    for (double& value : fit.of_sight) value += mean;
    for (std::size_t i = 0; i < heldout.size(); ++i) {
      double& gain = exposure.log_gain[i][c];
      if (!heldout[i]) {
        gain = fit.gain[static_cast<Eigen::Index>(i)] - mean;
        squares += gain * gain;
        continue;
      }
      const std::vector<int> near = nearest_views(data, heldout, i);
      std::vector<double> differences;
      for (std::size_t p = 0; p < sights.size(); ++p) {
        const bool seen = std::all_of(near.begin(), near.end(), [&](int view) {
          return std::any_of(sights[p].samples.begin(), sights[p].samples.end(),
                             [view](const Sample& s) { return s.view == view; });
        });
        Eigen::Array3f value;
        if (seen && images.seen_at(static_cast<int>(i), sights[p].position, value) && std::isfinite(value[c]) &&
            std::isfinite(fit.of_sight[p]))
          differences.push_back(value[c] - fit.of_sight[p]);
      }
      if (differences.size() >= enough_per_view) gain = median(differences);
    }
  }
  exposure.spread = std::sqrt(squares / (3 * std::max(1.0, training)));
  return exposure;
}

void even_out(const Exposure& exposure, std::vector<SceneView>& views) {
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Eigen::Array3f factor = (-exposure.log_gain[i]).exp().cast<float>();
    cv::Mat target = views[i].target.clone();
    for (int y = 0; y < target.rows; ++y)
      for (int x = 0; x < target.cols; ++x) {
        auto& rgb = target.at<cv::Vec3f>(y, x);
        bool lost = false;
        for (int c = 0; c < 3; ++c) {
          lost = lost || (rgb[c] >= 1 && factor[c] < 1);
          rgb[c] = std::min(1.0f, rgb[c] * factor[c]);
        }
        if (lost) rgb = cv::Vec3f::all(unknown);
      }
    views[i].target = target;
  }
}

}  // namespace orbitfuse::nerf
