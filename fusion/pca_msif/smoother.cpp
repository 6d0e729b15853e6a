// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/pca_msif/smoother.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace orbitfuse::fusion {
namespace {

/// Half-sample mirror: ... 1 0 | 0 1 2 ... n-1 | n-1 n-2 ...
int mirrored(int i, int n) { return i < 0 ? -1 - i : i >= n ? 2 * n - 1 - i : i; }

/// Rows of a padded copy, so that the inner loops have no border cases.
struct Padded {
  static constexpr int pad = 2;
  Plane data;
  int rows, cols;

  explicit Padded(cv::Size size)
      : data(size.height, size.width + 2 * pad), rows(size.height), cols(size.width) {}
  float* row(int y) { return data.ptr<float>(y) + pad; }
  const float* row_mirrored(int y) const { return data.ptr<float>(mirrored(y, rows)) + pad; }
  void mirror_ends(int y) {
    float* r = row(y);
    for (int i = 1; i <= pad; ++i) {
      r[-i] = r[mirrored(-i, cols)];
      r[cols - 1 + i] = r[mirrored(cols - 1 + i, cols)];
    }
  }
};

/// c D_xx I and c D_yy I of one row.
template <int reach>
void flux_row(const Padded& image, int y, float scale, float inverse_k2, float* xx, float* yy) {
  const float* c = image.row_mirrored(y);
  const float* up = image.row_mirrored(y - reach);
  const float* down = image.row_mirrored(y + reach);
  for (int x = 0; x < image.cols; ++x) {
    const float dxx = scale * (c[x - reach] - 2 * c[x] + c[x + reach]);
    const float dyy = scale * (up[x] - 2 * c[x] + down[x]);
    const float conduct = 1 / (1 + (dxx * dxx + dyy * dyy) * inverse_k2);
    xx[x] = conduct * dxx;
    yy[x] = conduct * dyy;
  }
}

template <int reach>
void step_row(const Padded& xx, const Padded& yy, int y, float scaled_step, float* image) {
  const float* h = xx.row_mirrored(y);
  const float* c = yy.row_mirrored(y);
  const float* up = yy.row_mirrored(y - reach);
  const float* down = yy.row_mirrored(y + reach);
  for (int x = 0; x < xx.cols; ++x)
    image[x] -= scaled_step * ((h[x - reach] - 2 * h[x] + h[x + reach]) + (up[x] - 2 * c[x] + down[x]));
}

template <int reach>
Plane diffused(const Plane& input, const SmootherOptions& options) {
  const float scale = reach == 2 ? 0.25F : 1.0F;
  const auto inverse_k2 = static_cast<float>(1 / (options.edge_scale * options.edge_scale));
  const float scaled_step = static_cast<float>(options.time_step) * scale;
  Padded image(input.size()), xx(input.size()), yy(input.size());
  for (int y = 0; y < input.rows; ++y) {
    std::copy_n(input.ptr<float>(y), input.cols, image.row(y));
    image.mirror_ends(y);
  }
  for (int t = 0; t < options.iterations; ++t) {
    // The step of a row follows the flux by `reach` rows, so both work on rows in the cache; the
    // flux above has read the row before it changes.
    for (int y = 0; y < input.rows + 2 * reach; ++y) {
      if (y < input.rows) {
        flux_row<reach>(image, y, scale, inverse_k2, xx.row(y), yy.row(y));
        xx.mirror_ends(y);
      }
      const int done = y - 2 * reach;
      if (done >= 0 && done < input.rows) {
        step_row<reach>(xx, yy, done, scaled_step, image.row(done));
        image.mirror_ends(done);
      }
    }
  }
  return image.data.colRange(Padded::pad, Padded::pad + input.cols).clone();
}

}  // namespace

double largest_stable_step(Stencil stencil) { return stencil == Stencil::wide ? 1.0 : 1.0 / 16; }

Status SmootherOptions::validate() const {
  const auto bad = [](const char* field, double value, const std::string& rule) {
    return fail(ErrorKind::usage, std::string("pca_msif.smoother.") + field, fmt::format("{}", value), rule);
  };
  if (iterations < 0 || iterations > 10000) return bad("iterations", iterations, "must be in 0..10000");
  const double limit = largest_stable_step(stencil);
  if (!(time_step > 0 && time_step <= limit))
    return bad("time_step", time_step,
               fmt::format("must be in (0, {}]: beyond it the {} stencil diverges", limit,
                           stencil == Stencil::wide ? "wide" : "compact"));
  if (!(edge_scale > 0 && edge_scale <= 1e6)) return bad("edge_scale", edge_scale, "must be in (0, 1e6]");
  return {};
}

Plane smooth(const Plane& image, const SmootherOptions& options) {
  return options.stencil == Stencil::wide ? diffused<2>(image, options) : diffused<1>(image, options);
}

}  // namespace orbitfuse::fusion
