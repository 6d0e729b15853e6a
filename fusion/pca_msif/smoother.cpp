// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/pca_msif/smoother.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/option_range.hpp"
#include "fusion/pca_msif/fast_explicit_diffusion.hpp"

namespace orbitfuse::fusion {
namespace {

/// Half-sample mirror: ... 1 0 | 0 1 2 ... n-1 | n-1 n-2 ...
int mirrored(int i, int n) { return i < 0 ? -1 - i : i >= n ? 2 * n - 1 - i : i; }

constexpr int pad = 2;  // columns beside a row, so that the inner loops have no border cases

/// Rows of `cols` samples with mirrored ends; `count` rows, used in turn when there are fewer of
/// them than of the image.
class PaddedRows {
 public:
  PaddedRows(int count, int cols)
      : count_(count),
        cols_(cols),
        data_(static_cast<std::size_t>(count) * static_cast<std::size_t>(cols + 2 * pad)) {}
  float* row(int y) {
    return data_.data() + static_cast<std::ptrdiff_t>(y % count_) * (cols_ + 2 * pad) + pad;
  }
  void mirror_ends(int y) {
    float* r = row(y);
    for (int i = 1; i <= pad; ++i) {
      r[-i] = r[mirrored(-i, cols_)];
      r[cols_ - 1 + i] = r[mirrored(cols_ - 1 + i, cols_)];
    }
  }

 private:
  int count_, cols_;
  std::vector<float> data_;
};

/// Image, conductivities and stencil that all time steps share.
struct Field {
  PaddedRows image, conductivity;
  cv::Size size;
  float inverse_k2;
};

/// One time step on its way down the image. Row y of the flux needs image rows y -+ reach before
/// the step, row y of the step needs flux rows y -+ reach; so the step follows `reach` rows behind
/// the flux, and only 2 reach + 1 rows of flux are kept. The stencil's scale is in inverse_k2 and
/// in dt.
template <int reach>
class TimeStep {
 public:
  /// new_conductivity: taken from the image before this step; otherwise the last taken one holds.
  TimeStep(Field& field, float dt, bool new_conductivity)
      : field_(&field),
        dt_(dt),
        new_conductivity_(new_conductivity),
        xx_(2 * reach + 1, field.size.width),
        yy_(2 * reach + 1, field.size.width) {}

  void advance(int y) {
    const int rows = field_->size.height;
    if (y >= 0 && y < rows) new_conductivity_ ? flux<true>(y) : flux<false>(y);
    if (y >= reach && y < rows + reach) step(y - reach);
  }

 private:
  /// c D_xx I and c D_yy I.
  template <bool takes_conductivity>
  void flux(int y) {
    const cv::Size size = field_->size;
    const float inverse_k2 = field_->inverse_k2;
    const float *c = field_->image.row(y),
                *up = field_->image.row(mirrored(y - reach, size.height)),
                *down = field_->image.row(mirrored(y + reach, size.height));
    float *xx = xx_.row(y), *yy = yy_.row(y), *conductivity = field_->conductivity.row(y);
#pragma GCC ivdep  // too many rows for the compiler's own overlap checks
    for (int x = 0; x < size.width; ++x) {
      const float dxx = std::fma(-2.0F, c[x], c[x - reach] + c[x + reach]);
      const float dyy = std::fma(-2.0F, c[x], up[x] + down[x]);
      if constexpr (takes_conductivity)
        conductivity[x] = 1 / std::fma(std::fma(dxx, dxx, dyy * dyy), inverse_k2, 1.0F);
      xx[x] = conductivity[x] * dxx;
      yy[x] = conductivity[x] * dyy;
    }
    xx_.mirror_ends(y);
  }

  void step(int y) {
    const cv::Size size = field_->size;
    const float *h = xx_.row(y), *c = yy_.row(y), *up = yy_.row(mirrored(y - reach, size.height)),
                *down = yy_.row(mirrored(y + reach, size.height));
    float* image = field_->image.row(y);
#pragma GCC ivdep
    for (int x = 0; x < size.width; ++x) {
      const float around = (h[x - reach] + h[x + reach]) + (up[x] + down[x]);
      image[x] = std::fma(-dt_, std::fma(-2.0F, h[x] + c[x], around), image[x]);
    }
    field_->image.mirror_ends(y);
  }

  Field* field_;
  float dt_;
  bool new_conductivity_;
  PaddedRows xx_, yy_;
};

/// Time steps that follow each other down the image at once: their rows stay in the second-level
/// cache, where single steps would fetch the whole image from memory every time.
constexpr std::size_t steps_at_once = 10;

/// dt of every step in order; in a list of its own, what shares one conductivity.
std::vector<std::vector<double>> schedule(const SmootherOptions& options) {
  const auto count = static_cast<std::size_t>(options.iterations);
  if (options.cycles == 0 || count == 0) return std::vector(count, std::vector{options.time_step});
  const double limit = largest_stable_step(options.stencil),
               time = options.iterations * options.time_step;
  const double cycles = std::max<double>(options.cycles, std::ceil(time / longest_cycle(limit)));
  return std::vector(static_cast<std::size_t>(cycles), fast_explicit_steps(time / cycles, limit));
}

template <int reach>
Plane diffused(const Plane& input, const SmootherOptions& options) {
  const double scale = reach == 2 ? 0.25 : 1.0;
  Field field{PaddedRows(input.rows, input.cols), PaddedRows(input.rows, input.cols), input.size(),
              static_cast<float>(scale * scale / (options.edge_scale * options.edge_scale))};
  for (int y = 0; y < input.rows; ++y) {
    std::copy_n(input[y], input.cols, field.image.row(y));
    field.image.mirror_ends(y);
  }
  std::vector<TimeStep<reach>> steps;
  for (const std::vector<double>& cycle : schedule(options))
    for (std::size_t i = 0; i < cycle.size(); ++i)
      steps.emplace_back(field, static_cast<float>(cycle[i] * scale * scale), i == 0);
  for (std::size_t first = 0; first < steps.size(); first += steps_at_once) {
    const int count = static_cast<int>(std::min(steps_at_once, steps.size() - first));
    // A step may work on row y once the one before has left row y + reach, 2 reach rows ahead.
    for (int front = 0; front < input.rows + reach + 2 * reach * (count - 1); ++front)
      for (int k = 0; k < count; ++k)
        steps[first + static_cast<std::size_t>(k)].advance(front - 2 * reach * k);
  }
  Plane result(input.size());
  for (int y = 0; y < input.rows; ++y) std::copy_n(field.image.row(y), input.cols, result[y]);
  return result;
}

}  // namespace

double largest_stable_step(Stencil stencil) { return stencil == Stencil::wide ? 1.0 : 1.0 / 16; }

Status SmootherOptions::validate() const {
  const OptionCheck check("pca_msif.smoother");
  ORBITFUSE_TRY(check("iterations", iterations, from_to(0, 10000)));
  ORBITFUSE_TRY(check("cycles", cycles, from_to(0, 10000)));
  // Beyond it the stencil diverges.
  ORBITFUSE_TRY(check("time_step", time_step, above_up_to(0, largest_stable_step(stencil))));
  return check("edge_scale", edge_scale, above_up_to(0, 1e6));
}

Plane smooth(const Plane& image, const SmootherOptions& options) {
  return options.stencil == Stencil::wide ? diffused<2>(image, options)
                                          : diffused<1>(image, options);
}

}  // namespace orbitfuse::fusion
