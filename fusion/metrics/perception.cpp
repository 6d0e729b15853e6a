// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <complex>
#include <opencv2/imgproc.hpp>

#include "core/system/parallel.hpp"
#include "fusion/metrics/blur.hpp"
#include "fusion/metrics/measures.hpp"

namespace orbitfuse::metrics {
namespace {

using Spectrum = cv::Mat_<std::complex<double>>;

/// Two real planes as one complex plane: filters that are real and even keep them apart.
Spectrum spectrum_of(const Plane& real, const Plane& imaginary) {
  cv::Mat packed, out;
  cv::merge(std::vector<cv::Mat>{real, imaginary}, packed);
  cv::dft(packed, out, cv::DFT_COMPLEX_OUTPUT);
  return out;
}

Spectrum spectrum_of(const Plane& real) {
  cv::Mat out;
  cv::dft(real, out, cv::DFT_COMPLEX_OUTPUT);
  return out;
}

/// Of a spectrum that spectrum_of(real) gave, filtered by what is real and even.
Plane plane_from(const Spectrum& spectrum) {
  cv::Mat out;
  cv::dft(spectrum, out, cv::DFT_INVERSE | cv::DFT_SCALE | cv::DFT_REAL_OUTPUT);
  return out;
}

std::pair<Plane, Plane> planes_from(const Spectrum& spectrum) {
  cv::Mat out;
  cv::dft(spectrum, out, cv::DFT_INVERSE | cv::DFT_SCALE);
  std::vector<cv::Mat> parts;
  cv::split(out, parts);
  return {Plane(parts[0]), Plane(parts[1])};
}

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

Spectrum times(const Spectrum& a, const Plane& s) {
  Spectrum out(a.size());
  for (int y = 0; y < a.rows; ++y) {
    for (int x = 0; x < a.cols; ++x) out(y, x) = a(y, x) * s(y, x);
  }
  return out;
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

double chen_blum(const Plane& cv_, const Plane& ci, const Plane& cf) {
  double sum = 0;
  for (int y = 0; y < cf.rows; ++y) {
    double row = 0;
    for (int x = 0; x < cf.cols; ++x) {
      const double a = cv_(y, x), b = ci(y, x), f = cf(y, x);
      // Saliency a^2 / (a^2 + b^2), without overflow and defined for a = b = 0.
      const double larger = std::max(a, b);
      const double wa = larger > 0 ? (a / larger) * (a / larger) : 1,
                   wb = larger > 0 ? (b / larger) * (b / larger) : 1;
      row += (wa * contrast_kept(a, f) + wb * contrast_kept(b, f)) / (wa + wb);
    }
    sum += row;
  }
  return sum / static_cast<double>(cf.total());
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

double chen_varshney(const Plane& visible, const Plane& thermal, const Plane& dv, const Plane& di) {
  const auto square = [](double d) { return d * d; };
  const Plane ev = edge_energy(visible), ei = edge_energy(thermal);
  const Plane lv = block_sums(dv, square), li = block_sums(di, square);
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

}  // namespace

Perception perception(const Plane& v, const Plane& i, const Plane& f) {
  Spectrum sources, single;
  Plane csf, sensitivity;
  parallel_for(4, [&](int task) {
    if (task == 0) sources = spectrum_of(v, i);
    if (task == 1) single = spectrum_of(f);
    if (task == 2) csf = radial_filter(f.size(), 30, chen_blum_response);
    if (task == 3) sensitivity = radial_filter(f.size(), 8, mannos_sakrison_response);
  });
  Plane cv_, ci, cf, dv, di;
  parallel_for(3, [&](int task) {
    if (task == 0) {
      const auto [a, b] = planes_from(times(sources, csf));
      cv_ = masked_contrast(a);
      ci = masked_contrast(b);
    } else if (task == 1) {
      cf = masked_contrast(plane_from(times(single, csf)));
    } else {
      // (V - F) + i (I - F) in one transform.
      Spectrum difference(single.size());
      for (int y = 0; y < single.rows; ++y) {
        for (int x = 0; x < single.cols; ++x) {
          const std::complex<double> s = single(y, x);
          difference(y, x) =
              sources(y, x) -
              std::complex<double>(s.real() - s.imag(), s.real() + s.imag());  // (1 + i) s
        }
      }
      std::tie(dv, di) = planes_from(times(difference, sensitivity));
    }
  });
  return {chen_blum(cv_, ci, cf), chen_varshney(v, i, dv, di)};
}

}  // namespace orbitfuse::metrics
