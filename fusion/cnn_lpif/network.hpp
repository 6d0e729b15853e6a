// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

// The siamese network of CNN-LPIF. After Liu et al. 2018 ("Infrared and visible image fusion with
// convolutional neural networks") both 16x16 patches pass the same convolutions; where they
// concatenate the branches, ours subtracts the branches' scores. So exchanging the images exchanges
// their weights exactly, identical patches get 1/2, and each image is convolved only once.
//   3x3 conv 1->8, ReLU, 2x2 max, 3x3 conv 8->16, ReLU, 5x5 conv 16->1 = score
//   P(a is the sharper patch) = 1 / (1 + exp(score_b - score_a))
namespace orbitfuse::fusion::cnn {

inline constexpr int patch = 16, kernel = 3, width1 = 8, width2 = 16;
inline constexpr int side1 = patch - 2, pooled = side1 / 2, side2 = pooled - 2;  // 14, 7, 5

/// Offsets of the parameters in one flat array.
struct Layout {
  static constexpr int conv1 = 0, bias1 = conv1 + width1 * 9, conv2 = bias1 + width1,
                       bias2 = conv2 + width2 * width1 * 9, head = bias2 + width2,
                       size = head + width2 * side2 * side2;
};

/// Float parameters as shipped or read; input error for another size or values not finite.
using Parameters = std::array<float, Layout::size>;
Result<Parameters> parameters_of_bytes(std::string_view bytes);
std::string bytes_of(const Parameters& parameters);
const Parameters& shipped_network();

/// What the backward pass needs of one patch's forward pass. T = double checks the gradients.
template <class T>
struct Activations {
  std::array<T, width1 * side1 * side1> conv1;
  std::array<T, width1 * pooled * pooled> pooled1;
  std::array<int, width1 * pooled * pooled> winner;  ///< index into conv1 of each maximum
  std::array<T, width2 * side2 * side2> conv2;
};

/// Score of one patch (row-major samples, gray levels / 255).
template <class T>
T score(const T* p, const T* in, Activations<T>& a) {
  for (int c = 0; c < width1; ++c)
    for (int y = 0; y < side1; ++y)
      for (int x = 0; x < side1; ++x) {
        T sum = p[Layout::bias1 + c];
        for (int k = 0; k < 9; ++k)
          sum += p[Layout::conv1 + c * 9 + k] * in[(y + k / 3) * patch + x + k % 3];
        a.conv1[static_cast<std::size_t>((c * side1 + y) * side1 + x)] = sum > 0 ? sum : 0;
      }
  for (int c = 0; c < width1; ++c)
    for (int y = 0; y < pooled; ++y)
      for (int x = 0; x < pooled; ++x) {
        int best = (c * side1 + 2 * y) * side1 + 2 * x;
        for (const int other : {best + 1, best + side1, best + side1 + 1})
          if (a.conv1[static_cast<std::size_t>(other)] > a.conv1[static_cast<std::size_t>(best)])
            best = other;
        const auto i = static_cast<std::size_t>((c * pooled + y) * pooled + x);
        a.winner[i] = best;
        a.pooled1[i] = a.conv1[static_cast<std::size_t>(best)];
      }
  T result = 0;
  for (int c = 0; c < width2; ++c)
    for (int y = 0; y < side2; ++y)
      for (int x = 0; x < side2; ++x) {
        T sum = p[Layout::bias2 + c];
        for (int d = 0; d < width1; ++d)
          for (int k = 0; k < 9; ++k)
            sum +=
                p[Layout::conv2 + (c * width1 + d) * 9 + k] *
                a.pooled1[static_cast<std::size_t>((d * pooled + y + k / 3) * pooled + x + k % 3)];
        const auto i = static_cast<std::size_t>((c * side2 + y) * side2 + x);
        a.conv2[i] = sum > 0 ? sum : 0;
        result += p[Layout::head + static_cast<int>(i)] * a.conv2[i];
      }
  return result;
}

/// Adds d score * `upstream` to the gradient of all parameters.
template <class T>
void backward(const T* p, const T* in, const Activations<T>& a, T upstream, T* gradient) {
  std::array<T, width1 * pooled * pooled> d_pooled{};
  for (int c = 0; c < width2; ++c)
    for (int y = 0; y < side2; ++y)
      for (int x = 0; x < side2; ++x) {
        const int i = (c * side2 + y) * side2 + x;
        const T value = a.conv2[static_cast<std::size_t>(i)];
        gradient[Layout::head + i] += upstream * value;
        if (!(value > 0)) continue;
        const T d = upstream * p[Layout::head + i];
        gradient[Layout::bias2 + c] += d;
        for (int e = 0; e < width1; ++e)
          for (int k = 0; k < 9; ++k) {
            const auto j = static_cast<std::size_t>((e * pooled + y + k / 3) * pooled + x + k % 3);
            const int w = Layout::conv2 + (c * width1 + e) * 9 + k;
            gradient[w] += d * a.pooled1[j];
            d_pooled[j] += d * p[w];
          }
      }
  for (std::size_t j = 0; j < d_pooled.size(); ++j) {
    if (!(a.pooled1[j] > 0) || d_pooled[j] == 0) continue;
    const int c = static_cast<int>(j) / (pooled * pooled);
    const int y = (a.winner[j] / side1) % side1, x = a.winner[j] % side1;
    gradient[Layout::bias1 + c] += d_pooled[j];
    for (int k = 0; k < 9; ++k)
      gradient[Layout::conv1 + c * 9 + k] += d_pooled[j] * in[(y + k / 3) * patch + x + k % 3];
  }
}

}  // namespace orbitfuse::fusion::cnn
