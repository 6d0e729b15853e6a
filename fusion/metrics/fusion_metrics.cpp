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

struct Definition {
  const char* name;
  const char* text;
};

constexpr Definition definitions[] = {
    {"MV", "mean of the fused image, 0..255"},
    {"SD", "standard deviation of the fused image (divisor N)"},
    {"EN", "entropy, 256 bins, bits"},
    {"SF", "spatial frequency (Eskicioglu and Fisher 1995), N = all pixels"},
    {"AG", "average gradient, central differences, / ((m-1)(n-1))"},
    {"EI", "edge intensity, mean 3x3 Sobel magnitude"},
    {"Qabf", "edge transfer (Xydeas and Petrovic 2000), VIFB's code"},
    {"MI", "MI(V,F) + MI(I,F), 256 bins of the stretched images, nats"},
    {"PSNR", "peak 255, of the mean squared error over both sources, dB"},
    {"RMSE", "mean of the root mean squared errors to both sources"},
    {"SSIM", "Wang 2004, 11x11 Gaussian, valid; mean over both sources"},
    {"CE", "cross entropy, mean over both sources, bits; lower is better"},
    {"Qcb", "Chen and Blum 2009, VIFB's code"},
    {"Qcv", "Chen and Varshney 2007, VIFB's code; lower is better"},
    {"SCD", "sum of correlations of differences (Aslantas and Bendes 2015)"},
    {"CC", "mean correlation with both sources"},
    {"PSNR_vifb", "as VIFB prints it (scaled by the image size)"},
    {"RMSE_vifb", "as VIFB prints it (scaled by the image size)"},
    {"SSIM_sum", "sum over both sources, as VIFB prints it"},
    {"halo",
     "level near edges far from both sources', 15x15 medians, gray levels; lower is better"},
};
constexpr std::size_t count = std::size(definitions);

/// What the tasks below find of one fused plane.
struct Measured {
  double mean = 0, deviation = 0, entropy = 0, spatial_frequency = 0, gradient = 0, edges = 0,
         transfer = 0, information = 0, cross_entropy = 0, mse_visible = 0, mse_thermal = 0,
         difference_correlation = 0, correlation = 0, halo = 0;
  SourceSimilarity similarity;
  Perception::Quality eye;
};

std::array<double, count> row_of(const Measured& m, std::size_t pixels) {
  const double rmse = (std::sqrt(m.mse_visible) + std::sqrt(m.mse_thermal)) / 2;
  const double rmse_vifb = rmse / std::sqrt(static_cast<double>(pixels));
  const double ssim_sum = m.similarity.visible + m.similarity.thermal;
  return {m.mean,
          m.deviation,
          m.entropy,
          m.spatial_frequency,
          m.gradient,
          m.edges,
          m.transfer,
          m.information,
          psnr_db((m.mse_visible + m.mse_thermal) / 2),
          rmse,
          ssim_sum / 2,
          m.cross_entropy,
          m.eye.qcb,
          m.eye.qcv,
          m.difference_correlation,
          m.correlation,
          psnr_db(rmse_vifb),
          rmse_vifb,
          ssim_sum,
          m.halo};
}

/// One channel of several fused images. Task by task, so that what a measure computes of the
/// sources is there once and only as long as that measure runs.
std::vector<Measured> measured(const Plane& v, const Plane& i, const std::vector<Plane>& fused) {
  std::vector<Measured> results(fused.size());
  const auto each = [&](const auto& measure) {
    for (std::size_t k = 0; k < fused.size(); ++k) measure(fused[k], results[k]);
  };
  const std::vector<std::function<void()>> tasks{
      [&] {
        const Perception eye(stretched(v), stretched(i));
        each([&](const Plane& f, Measured& m) { m.eye = eye.of(stretched(f)); });
      },
      [&] {
        const Halo halo(v, i);
        each([&](const Plane& f, Measured& m) { m.halo = halo.of(f); });
      },
      [&] {
        const StructuralSimilarity ssim(v, i);
        each([&](const Plane& f, Measured& m) { m.similarity = ssim.of(f); });
      },
      [&] {
        const EdgeTransfer transfer(v, i);
        each([&](const Plane& f, Measured& m) { m.transfer = transfer.of(f); });
      },
      [&] {
        const Plane wide_v = stretched(v), wide_i = stretched(i);
        each([&](const Plane& f, Measured& m) {
          const Plane wide = stretched(f);
          m.information =
              mutual_information_nats(wide_v, wide) + mutual_information_nats(wide_i, wide);
        });
      },
      [&] {
        each([&](const Plane& f, Measured& m) {
          m.entropy = entropy_bits(f);
          m.cross_entropy = (cross_entropy_bits(v, f) + cross_entropy_bits(i, f)) / 2;
        });
      },
      [&] {
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
      [&] {
        each([&](const Plane& f, Measured& m) {
          m.difference_correlation = correlation(f - i, v) + correlation(f - v, i);
          m.correlation = (correlation(v, f) + correlation(i, f)) / 2;
        });
      }};
  parallel_for(static_cast<int>(tasks.size()),
               [&](int t) { tasks[static_cast<std::size_t>(t)](); });
  return results;
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
  for (std::size_t c = 0; c < channels; ++c) {
    std::vector<Plane> of_channel;
    for (std::size_t k = 2; k < planes.size(); ++k) of_channel.push_back(planes[k][c]);
    const auto results = measured(planes[0][c], planes[1][c], of_channel);
    for (std::size_t k = 0; k < results.size(); ++k) {
      const auto of_image = row_of(results[k], planes[0][c].total());
      for (std::size_t m = 0; m < count; ++m)
        values[k][m].value += of_image[m] / static_cast<double>(channels);
    }
  }
  return values;
}

Result<std::vector<MetricValue>> fusion_metrics(const cv::Mat& visible, const cv::Mat& thermal,
                                                const cv::Mat& fused) {
  ORBITFUSE_ASSIGN(auto values, fusion_metrics(visible, thermal, std::vector<cv::Mat>{fused}));
  return std::move(values.front());
}

}  // namespace orbitfuse
