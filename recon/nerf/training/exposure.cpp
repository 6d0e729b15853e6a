// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/exposure.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/geometry/lens_fold.hpp"
#include "core/geometry/lifted.hpp"
#include "core/numeric/median.hpp"
#include "recon/nerf/training/confirms.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr float darkest = 0.04f, brightest = 0.96f;  ///< beyond, a sample is noise or clipped
constexpr float slight = 0.03f;  ///< gain that isn't worth losing highlights for
constexpr int enough_per_view = 50;
constexpr std::size_t most_per_sight = 24;
constexpr double usual = 0.03;  ///< residual of log samples: their noise and shading
constexpr float unknown_light = std::numeric_limits<float>::quiet_NaN();

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

/// Mean of 3x3 pixels round `pixel`; false outside the image.
bool sample_at(const cv::Mat& image, const Eigen::Vector2d& pixel, Eigen::Array3f& log_value) {
  if (!(pixel.x() >= 1 && pixel.y() >= 1 && pixel.x() < image.cols - 1 &&
        pixel.y() < image.rows - 1))
    return false;
  const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
  cv::Vec3f sum(0, 0, 0);
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx) sum += image.at<cv::Vec3f>(y + dy, x + dx);
  for (int c = 0; c < 3; ++c) {
    const float mean = sum[c] / 9;
    log_value[c] = mean > darkest && mean < brightest ? std::log(mean) : unknown_light;
  }
  return true;
}

bool seen_from(const TrainingView& view, const Eigen::Vector3d& world, Eigen::Array3f& log_value) {
  const Eigen::Vector3d p = view.cam_from_world * world;
  return p.z() > 0 && lens_holds(view.camera, p) &&
         sample_at(view.image, view.camera.project(p), log_value);
}

Sights sights_of_tracks(const Dataset& data, const std::vector<bool>& heldout) {
  Sights sights;
  for (const SparsePoint& point : data.points) {
    Sight sight{point.position, {}};
    for (const Observation& seen : point.track) {
      const auto view = static_cast<std::size_t>(seen.view);
      Sample sample{seen.view, {}};
      if (!heldout[view] && sight.samples.size() < most_per_sight &&
          sample_at(data.views[view].image, seen.pixel, sample.log_value))
        sight.samples.push_back(sample);
    }
    if (sight.samples.size() > 1) sights.push_back(std::move(sight));
  }
  return sights;
}

/// Points of the depth maps that other maps confirm within 1 %.
void add_sights_of_depth(const Dataset& data, const std::vector<bool>& heldout, Sights& sights) {
  const auto shows = [&](const DepthMap& map, const Eigen::Vector3d& world) {
    return confirms(map, data.views[static_cast<std::size_t>(map.view)].cam_from_world * world);
  };
  const auto trains = [&](const DepthMap& map) {
    return !heldout[static_cast<std::size_t>(map.view)];
  };
  const auto maps =
      static_cast<double>(std::count_if(data.depth.begin(), data.depth.end(), trains));
  const double per_map = std::clamp(4e6 / (maps * maps), 50.0, 1000.0);
  for (const DepthMap& map : data.depth) {
    if (!trains(map)) continue;
    const Rigid3d world_from_cam =
        data.views[static_cast<std::size_t>(map.view)].cam_from_world.inverse();
    const int step =
        std::max(1, static_cast<int>(std::sqrt(static_cast<double>(map.depth.total()) / per_map)));
    for (int y = step / 2; y < map.depth.rows; y += step)
      for (int x = step / 2; x < map.depth.cols; x += step) {
        if (!std::isfinite(map.depth.at<float>(y, x))) continue;
        Sight sight{world_from_cam * lifted(map.depth, map.camera, x, y), {}};
        for (const DepthMap& other : data.depth) {
          Sample sample{other.view, {}};
          if (trains(other) && sight.samples.size() < most_per_sight &&
              (&other == &map || shows(other, sight.position)) &&
              seen_from(data.views[static_cast<std::size_t>(other.view)], sight.position,
                        sample.log_value))
            sight.samples.push_back(sample);
        }
        if (sight.samples.size() > 1) sights.push_back(std::move(sight));
      }
  }
}

/// Finite samples of a channel by view, where another view has one too.
std::vector<int> support_of(const Sights& sights, std::size_t views, int channel) {
  std::vector<int> counts(views, 0);
  for (const Sight& sight : sights) {
    const auto finite = [&](const Sample& s) { return std::isfinite(s.log_value[channel]); };
    if (std::count_if(sight.samples.begin(), sight.samples.end(), finite) < 2) continue;
    for (const Sample& s : sight.samples)
      counts[static_cast<std::size_t>(s.view)] += finite(s) ? 1 : 0;
  }
  return counts;
}

bool too_few(const Sights& sights, const std::vector<bool>& heldout) {
  const std::vector<int> counts = support_of(sights, heldout.size(), 1);
  for (std::size_t i = 0; i < counts.size(); ++i)
    if (!heldout[i] && counts[i] < enough_per_view) return true;
  return false;
}

struct ChannelFit {
  std::vector<int> place;  ///< per view: its row in `gain`, -1 without enough support
  Eigen::VectorXd gain;
  std::vector<double> of_sight;  ///< NaN: fewer than two views show this channel
  double gain_of(std::size_t view) const { return gain[place[view]]; }
};

/// Points are eliminated, so each turn solves a system of the views alone.
ChannelFit fit_channel(const Sights& sights, std::size_t views, int channel) {
  ChannelFit fit{
      std::vector<int>(views, -1), {}, std::vector<double>(sights.size(), unknown_light)};
  const std::vector<int> support = support_of(sights, views, channel);
  int size = 0;
  for (std::size_t i = 0; i < views; ++i)
    if (support[i] >= enough_per_view) fit.place[i] = size++;
  fit.gain = Eigen::VectorXd::Zero(size);
  constexpr double prior =
      1e-2;  // parts of the orbit that nothing ties together each have mean zero
  struct Weighed {
    int place;
    double value, weight;
  };
  std::vector<std::vector<Weighed>> used(sights.size());
  for (std::size_t p = 0; p < sights.size(); ++p)
    for (const Sample& s : sights[p].samples)
      if (const int place = fit.place[static_cast<std::size_t>(s.view)];
          place >= 0 && std::isfinite(s.log_value[channel]))
        used[p].push_back({place, s.log_value[channel], 1});
  for (int turn = 0; turn < 12; ++turn) {
    Eigen::MatrixXd normal = prior * Eigen::MatrixXd::Identity(size, size);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
    for (const std::vector<Weighed>& samples : used) {
      if (samples.size() < 2) continue;
      double total = 0, mean = 0;
      for (const Weighed& s : samples) total += s.weight;
      for (const Weighed& s : samples) mean += s.weight * s.value / total;
      for (const Weighed& s : samples) {
        right[s.place] += s.weight * (s.value - mean);
        normal(s.place, s.place) += s.weight;
        for (const Weighed& o : samples) normal(s.place, o.place) -= s.weight * o.weight / total;
      }
    }
    fit.gain = normal.ldlt().solve(right);
    for (std::size_t p = 0; p < sights.size(); ++p) {
      if (used[p].size() < 2) continue;
      double total = 0, mean = 0;
      for (const Weighed& s : used[p]) {
        total += s.weight;
        mean += s.weight * (s.value - fit.gain[s.place]);
      }
      fit.of_sight[p] = mean / total;
      for (Weighed& s : used[p]) {
        const double residual = s.value - fit.gain[s.place] - fit.of_sight[p];
        s.weight = std::pow(usual / std::max(usual, std::abs(residual)),
                            2);  // wrong matches count for nothing
      }
    }
  }
  return fit;
}

/// The two training views that look most alike.
std::vector<int> nearest_views(const Dataset& data, const std::vector<bool>& heldout,
                               std::size_t view) {
  const auto axis = [&](std::size_t i) -> Eigen::Vector3d {
    return data.views[i].cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ();
  };
  std::vector<int> others;
  for (std::size_t i = 0; i < heldout.size(); ++i)
    if (!heldout[i]) others.push_back(static_cast<int>(i));
  const auto count = std::min<std::size_t>(2, others.size());
  std::partial_sort(others.begin(), others.begin() + static_cast<std::ptrdiff_t>(count),
                    others.end(), [&](int a, int b) {
                      return axis(static_cast<std::size_t>(a)).dot(axis(view)) >
                             axis(static_cast<std::size_t>(b)).dot(axis(view));
                    });
  others.resize(count);
  return others;
}

}  // namespace

Exposure estimate_exposure(const Dataset& data, const std::vector<bool>& heldout) {
  Exposure exposure;
  const std::size_t views = data.views.size();
  exposure.log_gain.assign(views, Eigen::Array3d::Constant(unknown_light));
  Sights sights = sights_of_tracks(data, heldout);
  if (too_few(sights, heldout)) add_sights_of_depth(data, heldout, sights);
  exposure.points = static_cast<int>(sights.size());
  for (int c = 0; c < 3; ++c) {
    const ChannelFit fit = fit_channel(sights, views, c);
    const double mean = fit.gain.size() > 0 ? fit.gain.mean() : 0;
    for (std::size_t i = 0; i < views; ++i) {
      double& gain = exposure.log_gain[i][c];
      if (fit.place[i] >= 0) gain = fit.gain_of(i) - mean;
      if (!heldout[i]) continue;
      const std::vector<int> near = nearest_views(data, heldout, i);
      std::vector<double> differences;
      for (std::size_t p = 0; p < sights.size(); ++p) {
        const bool seen = std::all_of(near.begin(), near.end(), [&](int view) {
          return std::any_of(sights[p].samples.begin(), sights[p].samples.end(),
                             [view](const Sample& s) { return s.view == view; });
        });
        Eigen::Array3f value;
        if (seen && std::isfinite(fit.of_sight[p]) &&
            seen_from(data.views[i], sights[p].position, value) && std::isfinite(value[c]))
          differences.push_back(value[c] - fit.of_sight[p] - mean);
      }
      if (differences.size() >= enough_per_view) gain = median(differences);
    }
  }
  double squares = 0, count = 0;
  for (std::size_t i = 0; i < views; ++i) {
    // A channel of which nothing is known goes with the others, so that no hue is made.
    Eigen::Array3d& gain = exposure.log_gain[i];
    const Eigen::Array3d known = gain.isFinite().cast<double>();
    const double others =
        known.sum() > 0 ? (gain.isFinite().select(gain, 0)).sum() / known.sum() : 0;
    gain = gain.isFinite().select(gain, others);
    if (heldout[i]) continue;
    squares += gain.square().sum();
    count += 3;
    exposure.largest = std::max(exposure.largest, gain.abs().maxCoeff());
  }
  exposure.spread = std::sqrt(squares / std::max(1.0, count));
  return exposure;
}

void even_out(cv::Mat& image, const Eigen::Array3d& gain) {
  const Eigen::Array3f factor = gain.inverse().cast<float>();
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      auto& rgb = image.at<cv::Vec3f>(y, x);
      bool lost = false;
      for (int c = 0; c < 3; ++c) {
        lost = lost || (rgb[c] >= brightest && factor[c] < 1 - slight);
        rgb[c] = std::min(1.0f, rgb[c] * factor[c]);
      }
      if (lost) rgb = cv::Vec3f::all(unknown_light);
    }
}

void even_out(const Exposure& exposure, std::vector<NormalisedView>& views) {
  for (std::size_t i = 0; i < views.size(); ++i)
    even_out(views[i].target, exposure.log_gain[i].exp());
}

}  // namespace orbitfuse::nerf
