// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <complex>
#include <opencv2/imgproc.hpp>

#include "fusion/metrics/blur.hpp"
#include "fusion/metrics/measures.hpp"

namespace orbitfuse::metrics {
namespace {

using Spectrum = cv::Mat_<std::complex<double>>;

/// Frequency of a DFT index in MATLAB's freqspace, -1..1 (1 = Nyquist), here without the shift.
double unit_frequency(int index, int count) {
  const int half = count / 2;
  const int signed_index = count % 2 == 0 ? (index < half ? index : index - count)
                                          : (index <= half ? index : index - count);
  return 2.0 * signed_index / count;
}

/// S(r) with u = width/divisor * fx, v = height/divisor * fy, in cycles per degree by convention.
Plane radial_filter(cv::Size size, double divisor, double (*response)(double)) {
  Plane s(size);
  // Frequency -f lies as far from the end as f from the start: one quadrant holds all answers.
  for (int y = 0; y <= size.height / 2; ++y) {
    const double v = unit_frequency(y, size.height) * size.height / divisor;
    for (int x = 0; x <= size.width / 2; ++x) {
      const double u = unit_frequency(x, size.width) * size.width / divisor;
      s(y, x) = response(std::sqrt(u * u + v * v));
    }
    for (int x = size.width / 2 + 1; x < size.width; ++x) s(y, x) = s(y, size.width - x);
  }
  for (int y = size.height / 2 + 1; y < size.height; ++y) s.row(size.height - y).copyTo(s.row(y));
  return s;
}

/// A plane through two filters that are real and even: one transform back gives both, as the real
/// and the imaginary part.
std::pair<Plane, Plane> filtered(const Plane& plane, const Plane& a, const Plane& b) {
  Spectrum spectrum;
  cv::dft(plane, spectrum, cv::DFT_COMPLEX_OUTPUT);
  for (int y = 0; y < spectrum.rows; ++y) {
    for (int x = 0; x < spectrum.cols; ++x) {  // times a + i b; `*=` would look for NaN each time
      const std::complex<double> s = spectrum(y, x);
      spectrum(y, x) = {s.real() * a(y, x) - s.imag() * b(y, x),
                        s.real() * b(y, x) + s.imag() * a(y, x)};
    }
  }
  cv::Mat out, parts[2];
  cv::dft(spectrum, out, cv::DFT_INVERSE | cv::DFT_SCALE);
  cv::split(out, parts);
  return {Plane(parts[0]), Plane(parts[1])};
}

/// Contrast-sensitivity difference of Gaussians of Chen and Blum.
double chen_blum_response(double r) {
  const double wide = r / 15.3870, narrow = r / 1.3456;
  return std::exp(-wide * wide) - 0.7622 * std::exp(-narrow * narrow);
}

/// Mannos and Sakrison with the constants of the published code.
double mannos_sakrison_response(double r) {
  return 2.6 * (0.0192 + 0.144 * r) * std::exp(-std::pow(0.144 * r, 1.1));
}

/// Masked contrast: |blur_2 / blur_4 - 1| through C^3 / (C^2 + 0.0001).
Plane masked_contrast(const Plane& f) {
  const auto smooth = [&](double sigma) {
    return blurred(f, gaussian_half(sigma, 15, 1 / (std::sqrt(2 * M_PI) * sigma)));
  };
  const Plane fine = smooth(2), coarse = smooth(4);
  Plane out(f.size());
  for (int y = 0; y < f.rows; ++y) {
    for (int x = 0; x < f.cols; ++x) {
      const double c = coarse(y, x) != 0 ? std::abs(fine(y, x) / coarse(y, x) - 1) : 0;
      // c^3 overflows for c beyond 1e102, where the fraction is c.
      out(y, x) = c < 1e50 ? c * c * c / (c * c + 1e-4) : c;
    }
  }
  return out;
}

double contrast_kept(double source, double fused) {
  if (source == fused) return 1;
  return source < fused ? source / fused : fused / source;
}

/// Sums over 16 x 16 blocks; blocks at the border are filled up with zeros, as blkproc does.
template <class Function>
Plane block_sums(const Plane& f, const Function& of) {
  Plane out((f.rows + 15) / 16, (f.cols + 15) / 16, 0.0);
  for (int y = 0; y < f.rows; ++y) {
    for (int x = 0; x < f.cols; ++x) out(y / 16, x / 16) += of(f(y, x));
  }
  return out;
}

Plane edge_energy(const Plane& f) {
  cv::Mat1d gx, gy;
  cv::Sobel(f, gx, CV_64F, 1, 0, 3, 1, 0, cv::BORDER_CONSTANT);
  cv::Sobel(f, gy, CV_64F, 0, 1, 3, 1, 0, cv::BORDER_CONSTANT);
  const Plane squared = gx.mul(gx) + gy.mul(gy);
  return block_sums(squared, [](double g2) { return g2 * g2 * std::sqrt(g2); });  // |g|^5
}

}  // namespace

Perception::Perception(const Plane& visible, const Plane& thermal)
    : contrast_filter_(radial_filter(visible.size(), 30, chen_blum_response)),
      sensitivity_filter_(radial_filter(visible.size(), 8, mannos_sakrison_response)),
      visible_(seen(visible)),
      thermal_(seen(thermal)),
      visible_energy_(edge_energy(visible)),
      thermal_energy_(edge_energy(thermal)) {}

Perception::Seen Perception::seen(const Plane& plane) const {
  const auto [contrast, sensitivity] = filtered(plane, contrast_filter_, sensitivity_filter_);
  return {masked_contrast(contrast), sensitivity};
}

double Perception::chen_blum(const Plane& fused) const {
  double sum = 0;
  for (int y = 0; y < fused.rows; ++y) {
    double row = 0;
    for (int x = 0; x < fused.cols; ++x) {
      const double a = visible_.contrast(y, x), b = thermal_.contrast(y, x), f = fused(y, x);
      // Saliency a^2 / (a^2 + b^2), without overflow and defined for a = b = 0.
      const double larger = std::max(a, b);
      const double wa = larger > 0 ? (a / larger) * (a / larger) : 1,
                   wb = larger > 0 ? (b / larger) * (b / larger) : 1;
      row += (wa * contrast_kept(a, f) + wb * contrast_kept(b, f)) / (wa + wb);
    }
    sum += row;
  }
  return sum / static_cast<double>(fused.total());
}

double Perception::chen_varshney(const Plane& fused) const {
  const auto square = [](double d) { return d * d; };
  const Plane &ev = visible_energy_, &ei = thermal_energy_;
  const Plane lv = block_sums(visible_.sensitivity - fused, square),
              li = block_sums(thermal_.sensitivity - fused, square);
  double sum = 0, weight = 0, plain = 0;
  for (int y = 0; y < ev.rows; ++y) {
    for (int x = 0; x < ev.cols; ++x) {
      sum += (ev(y, x) * lv(y, x) + ei(y, x) * li(y, x)) / 256;
      weight += ev(y, x) + ei(y, x);
      plain += (lv(y, x) + li(y, x)) / 256;
    }
  }
  return weight > 0 ? sum / weight : plain / (2 * static_cast<double>(ev.total()));
}

Perception::Quality Perception::of(const Plane& fused) const {
  const Seen by_eye = seen(fused);
  return {chen_blum(by_eye.contrast), chen_varshney(by_eye.sensitivity)};
}

}  // namespace orbitfuse::metrics
