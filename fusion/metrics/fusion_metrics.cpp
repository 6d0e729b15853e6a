// SPDX-License-Identifier: BSD-3-Clause
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

std::array<double, count> of_planes(const Plane& v, const Plane& i, const Plane& f) {
  std::array<Plane, 3> wide;  // stretched to 0..255, as some measures are defined
  parallel_for(3, [&](int k) {
    wide[static_cast<std::size_t>(k)] = stretched(k == 0 ? v : k == 1 ? i : f);
  });
  Perception eye;
  double ssim_v = 0, ssim_i = 0, qabf = 0, en = 0, mi = 0, ce = 0, sf = 0, ag = 0, ei = 0, scd = 0,
         cc = 0, mse_v = 0, mse_i = 0, glow = 0;
  const std::vector<std::function<void()>> tasks{
      [&] { eye = perception(wide[0], wide[1], wide[2]); },
      [&] { glow = halo(v, i, f); },
      [&] { ssim_v = structural_similarity(v, f); },
      [&] { ssim_i = structural_similarity(i, f); },
      [&] { qabf = edge_transfer(v, i, f); },
      [&] {
        mi = mutual_information_nats(wide[0], wide[2]) + mutual_information_nats(wide[1], wide[2]);
      },
      [&] {
        en = entropy_bits(f);
        ce = (cross_entropy_bits(v, f) + cross_entropy_bits(i, f)) / 2;
      },
      [&] {
        mse_v = mean_squared_error(v, f);
        mse_i = mean_squared_error(i, f);
        sf = spatial_frequency(f);
        ag = average_gradient(f);
        ei = edge_intensity(f);
      },
      [&] {
        scd = correlation(f - i, v) + correlation(f - v, i);
        cc = (correlation(v, f) + correlation(i, f)) / 2;
      }};
  parallel_for(static_cast<int>(tasks.size()),
               [&](int t) { tasks[static_cast<std::size_t>(t)](); });
  const double rmse = (std::sqrt(mse_v) + std::sqrt(mse_i)) / 2;
  const double rmse_vifb = rmse / std::sqrt(static_cast<double>(f.total()));
  return {mean(f),
          standard_deviation(f),
          en,
          sf,
          ag,
          ei,
          qabf,
          mi,
          psnr_db((mse_v + mse_i) / 2),
          rmse,
          (ssim_v + ssim_i) / 2,
          ce,
          eye.qcb,
          eye.qcv,
          scd,
          cc,
          psnr_db(rmse_vifb),
          rmse_vifb,
          ssim_v + ssim_i,
          glow};
}

}  // namespace

Result<std::vector<MetricValue>> fusion_metrics(const cv::Mat& visible, const cv::Mat& thermal,
                                                const cv::Mat& fused) {
  ORBITFUSE_ASSIGN(const auto planes,
                   matched_planes({visible, thermal, fused}, {"visible", "thermal", "fused"}, 16));
  std::vector<MetricValue> values;
  for (const Definition& d : definitions) values.push_back({d.name, d.text, 0});
  const std::size_t channels = planes[2].size();
  for (std::size_t c = 0; c < channels; ++c) {
    const auto of_channel = of_planes(planes[0][c], planes[1][c], planes[2][c]);
    for (std::size_t m = 0; m < count; ++m)
      values[m].value += of_channel[m] / static_cast<double>(channels);
  }
  return values;
}

}  // namespace orbitfuse
