// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>
#include <functional>

#include "core/system/parallel.hpp"
#include "fusion/metrics/measures.hpp"
#include "fusion/metrics/metrics.hpp"

namespace orbitfuse {
namespace {

using namespace metrics;

/// What the tasks below find of one fused plane.
struct Measured {
  double mean = 0, deviation = 0, entropy = 0, spatial_frequency = 0, gradient = 0, edges = 0,
         transfer = 0, information = 0, cross_entropy = 0, mse_visible = 0, mse_thermal = 0,
         difference_correlation = 0, correlation = 0, halo = 0;
  std::size_t pixels = 0;
  SourceSimilarity similarity;
  Perception::Quality eye;

  double rmse() const { return (std::sqrt(mse_visible) + std::sqrt(mse_thermal)) / 2; }
  double rmse_vifb() const { return rmse() / std::sqrt(static_cast<double>(pixels)); }
  double ssim_sum() const { return similarity.visible + similarity.thermal; }
};

struct Definition {
  const char* name;
  const char* text;
  double (*value)(const Measured&);
};

using M = const Measured&;
constexpr Definition definitions[] = {
    {"MV", "mean of the fused image, 0..255", [](M m) { return m.mean; }},
    {"SD", "standard deviation of the fused image (divisor N)", [](M m) { return m.deviation; }},
    {"EN", "entropy, 256 bins, bits", [](M m) { return m.entropy; }},
    {"SF", "spatial frequency (Eskicioglu and Fisher 1995), N = all pixels",
     [](M m) { return m.spatial_frequency; }},
    {"AG", "average gradient, central differences, / ((m-1)(n-1))", [](M m) { return m.gradient; }},
    {"EI", "edge intensity, mean 3x3 Sobel magnitude", [](M m) { return m.edges; }},
    {"Qabf", "edge transfer (Xydeas and Petrovic 2000), VIFB's code",
     [](M m) { return m.transfer; }},
    {"MI", "MI(V,F) + MI(I,F), 256 bins of the stretched images, nats",
     [](M m) { return m.information; }},
    {"PSNR", "peak 255, of the mean squared error over both sources, dB",
     [](M m) { return psnr_db((m.mse_visible + m.mse_thermal) / 2); }},
    {"RMSE", "mean of the root mean squared errors to both sources", [](M m) { return m.rmse(); }},
    {"SSIM", "Wang 2004, 11x11 Gaussian, valid; mean over both sources",
     [](M m) { return m.ssim_sum() / 2; }},
    {"CE", "cross entropy, mean over both sources, bits; lower is better",
     [](M m) { return m.cross_entropy; }},
    {"Qcb", "Chen and Blum 2009, VIFB's code", [](M m) { return m.eye.qcb; }},
    {"Qcv", "Chen and Varshney 2007, VIFB's code; lower is better", [](M m) { return m.eye.qcv; }},
    {"SCD", "sum of correlations of differences (Aslantas and Bendes 2015)",
     [](M m) { return m.difference_correlation; }},
    {"CC", "mean correlation with both sources", [](M m) { return m.correlation; }},
    {"PSNR_vifb", "as VIFB prints it (scaled by the image size)",
     [](M m) { return psnr_db(m.rmse_vifb()); }},
    {"RMSE_vifb", "as VIFB prints it (scaled by the image size)",
     [](M m) { return m.rmse_vifb(); }},
    {"SSIM_sum", "sum over both sources, as VIFB prints it", [](M m) { return m.ssim_sum(); }},
    {"halo", "level near edges far from both sources', 15x15 medians, gray levels; lower is better",
     [](M m) { return m.halo; }},
};

using Tasks = std::vector<std::function<void()>>;

/// What there is to measure of one channel of several fused images, the longest first. Task by
/// task, so that what a measure computes of the sources is there once and only as long as that
/// measure runs. The arguments outlive the tasks.
Tasks tasks_of(const Plane& v, const Plane& i, const std::vector<Plane>& fused,
               std::vector<Measured>& results) {
  const auto each = [&fused, &results](const auto& measure) {
    for (std::size_t k = 0; k < fused.size(); ++k) measure(fused[k], results[k]);
  };
  return {[&v, &i, each] {
            const Perception eye(stretched(v), stretched(i));
            each([&](const Plane& f, Measured& m) { m.eye = eye.of(stretched(f)); });
          },
          [&v, &i, each] {
            const Halo halo(v, i);
            each([&](const Plane& f, Measured& m) { m.halo = halo.of(f); });
          },
          [&v, &i, each] {
            const StructuralSimilarity ssim(v, i);
            each([&](const Plane& f, Measured& m) { m.similarity = ssim.of(f); });
          },
          [&v, &i, each] {
            const EdgeTransfer transfer(v, i);
            each([&](const Plane& f, Measured& m) { m.transfer = transfer.of(f); });
          },
          [&v, &i, each] {
            const Plane wide_v = stretched(v), wide_i = stretched(i);
            each([&](const Plane& f, Measured& m) {
              const Plane wide = stretched(f);
              m.information =
                  mutual_information_nats(wide_v, wide) + mutual_information_nats(wide_i, wide);
            });
          },
          [&v, &i, each] {
            each([&](const Plane& f, Measured& m) {
              m.entropy = entropy_bits(f);
              m.cross_entropy = (cross_entropy_bits(v, f) + cross_entropy_bits(i, f)) / 2;
            });
          },
          [&v, &i, each] {
            each([&](const Plane& f, Measured& m) {
              m.mean = mean(f);
              m.deviation = standard_deviation(f);
              m.mse_visible = mean_squared_error(v, f);
              m.mse_thermal = mean_squared_error(i, f);
              m.spatial_frequency = spatial_frequency(f);
              m.gradient = average_gradient(f);
              m.edges = edge_intensity(f);
            });
          },
          [&v, &i, each] {
            each([&](const Plane& f, Measured& m) {
              m.difference_correlation = correlation(f - i, v) + correlation(f - v, i);
              m.correlation = (correlation(v, f) + correlation(i, f)) / 2;
            });
          }};
}

}  // namespace

Result<std::vector<std::vector<MetricValue>>> fusion_metrics(const cv::Mat& visible,
                                                             const cv::Mat& thermal,
                                                             const std::vector<cv::Mat>& fused) {
  std::vector<cv::Mat> images{visible, thermal};
  std::vector<std::string> names{"visible", "thermal"};
  for (const cv::Mat& image : fused) {
    images.push_back(image);
    names.push_back(fused.size() == 1 ? "fused" : fmt::format("fused image {}", images.size() - 2));
  }
  ORBITFUSE_ASSIGN(const auto planes, matched_planes(images, names, 16));
  std::vector<MetricValue> row;
  for (const Definition& d : definitions) row.push_back({d.name, d.text, 0});
  std::vector<std::vector<MetricValue>> values(fused.size(), row);
  const std::size_t channels = planes[0].size();
  std::vector<std::vector<Plane>> of_channel(channels);
  Measured blank;
  blank.pixels = planes[0][0].total();
  std::vector<std::vector<Measured>> results(channels, std::vector<Measured>(fused.size(), blank));
  std::vector<Tasks> tasks;
  for (std::size_t c = 0; c < channels; ++c) {
    for (std::size_t k = 2; k < planes.size(); ++k) of_channel[c].push_back(planes[k][c]);
    tasks.push_back(tasks_of(planes[0][c], planes[1][c], of_channel[c], results[c]));
  }
  Tasks all;
  for (std::size_t t = 0; t < tasks[0].size(); ++t)
    for (Tasks& of_one : tasks) all.push_back(std::move(of_one[t]));
  parallel_tasks(all);
  for (const std::vector<Measured>& of_one : results)
    for (std::size_t k = 0; k < fused.size(); ++k)
      for (std::size_t m = 0; m < std::size(definitions); ++m)
        values[k][m].value += definitions[m].value(of_one[k]) / static_cast<double>(channels);
  return values;
}

Result<std::vector<MetricValue>> fusion_metrics(const cv::Mat& visible, const cv::Mat& thermal,
                                                const cv::Mat& fused) {
  ORBITFUSE_ASSIGN(auto values, fusion_metrics(visible, thermal, std::vector<cv::Mat>{fused}));
  return std::move(values.front());
}

}  // namespace orbitfuse
