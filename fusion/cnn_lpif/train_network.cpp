// SPDX-License-Identifier: BSD-3-Clause
// train_network OUT.bin [PAIRS] [EPOCHS]: trains the network that CNN-LPIF ships, on pairs of one
// patch of a dead-leaves image, sharp and blurred; prints loss and validation accuracy as CSV.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "core/system/file_io.hpp"
#include "core/system/parallel.hpp"
#include "fusion/cnn_lpif/network.hpp"
#include "fusion/training/dead_leaves.hpp"

using namespace orbitfuse;
using namespace orbitfuse::fusion;

namespace {

struct Pair {
  std::array<float, cnn::patch * cnn::patch> sharp, blurred;
};

std::vector<Pair> make_pairs(int count, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<Pair> pairs;
  Plane sharp, blurred;
  while (static_cast<int>(pairs.size()) < count) {
    if (pairs.size() % 200 == 0) {
      sharp = dead_leaves({200, 200}, random());
      const auto gain = static_cast<float>(uniform(random, 0.3, 1));
      sharp = sharp * gain +
              static_cast<float>(uniform(random, 0, 255 * (1 - static_cast<double>(gain))));
      // Sensors blur and have noise: the sharp side is a little soft, both are a little noisy.
      cv::GaussianBlur(sharp, sharp, {}, uniform(random, 0.3, 0.8));
      cv::GaussianBlur(sharp, blurred, {}, uniform(random, 1, 4));
    }
    const int x = static_cast<int>(random() % static_cast<std::uint32_t>(sharp.cols - cnn::patch));
    const int y = static_cast<int>(random() % static_cast<std::uint32_t>(sharp.rows - cnn::patch));
    const cv::Rect box(x, y, cnn::patch, cnn::patch);
    if (cv::norm(sharp(box), blurred(box), cv::NORM_L2) < 16) continue;  // no difference to learn
    Pair pair;
    const float noise = static_cast<float>(uniform(random, 0, 2));
    for (int i = 0; i < cnn::patch * cnn::patch; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const auto jitter = [&] { return noise * static_cast<float>(uniform(random, -1, 1)); };
      pair.sharp[k] = (sharp(y + i / cnn::patch, x + i % cnn::patch) + jitter()) / 255;
      pair.blurred[k] = (blurred(y + i / cnn::patch, x + i % cnn::patch) + jitter()) / 255;
    }
    pairs.push_back(pair);
  }
  return pairs;
}

/// Logistic loss of "the sharp one scores higher" and its gradient.
double loss_of(const cnn::Parameters& p, const Pair& pair, cnn::Parameters* gradient) {
  cnn::Activations<float> a, b;
  const float d =
      cnn::score(p.data(), pair.sharp.data(), a) - cnn::score(p.data(), pair.blurred.data(), b);
  if (gradient) {
    const float slope = -1 / (1 + std::exp(d));
    cnn::backward(p.data(), pair.sharp.data(), a, slope, gradient->data());
    cnn::backward(p.data(), pair.blurred.data(), b, -slope, gradient->data());
  }
  return static_cast<double>(std::log1p(std::exp(-std::abs(d))) + std::max(0.0F, -d));
}

cnn::Parameters random_start(std::uint32_t seed) {
  std::mt19937 random(seed);
  cnn::Parameters p{};
  const auto fill = [&](int begin, int end, int fan_in) {
    const double bound = std::sqrt(6.0 / fan_in);  // He et al. 2015
    for (int i = begin; i < end; ++i)
      p[static_cast<std::size_t>(i)] = static_cast<float>(uniform(random, -bound, bound));
  };
  fill(cnn::Layout::conv1, cnn::Layout::bias1, 9);
  fill(cnn::Layout::conv2, cnn::Layout::bias2, 9 * cnn::width1);
  fill(cnn::Layout::head, cnn::Layout::size, cnn::width2 * cnn::side2 * cnn::side2);
  return p;
}

struct Adam {
  cnn::Parameters first{}, second{};
  int step = 0;
  void apply(cnn::Parameters& p, const cnn::Parameters& g, float rate) {
    ++step;
    const float c1 = 1 - std::pow(0.9F, static_cast<float>(step)),
                c2 = 1 - std::pow(0.999F, static_cast<float>(step));
    for (std::size_t i = 0; i < p.size(); ++i) {
      first[i] = 0.9F * first[i] + 0.1F * g[i];
      second[i] = 0.999F * second[i] + 0.001F * g[i] * g[i];
      p[i] -= rate * (first[i] / c1) / (std::sqrt(second[i] / c2) + 1e-8F);
    }
  }
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "train_network OUT.bin [PAIRS] [EPOCHS]\n");
    return 2;
  }
  const int count = argc > 2 ? std::atoi(argv[2]) : 20000,
            epochs = argc > 3 ? std::atoi(argv[3]) : 6;
  constexpr int batch = 64, lanes = 8;
  const std::vector<Pair> train = make_pairs(count, 1),
                          validation = make_pairs(std::max(200, count / 10), 2);
  cnn::Parameters parameters = random_start(3);
  Adam adam;
  std::vector<int> order(train.size());
  std::iota(order.begin(), order.end(), 0);
  std::mt19937 random(4);
  fmt::print("epoch,train_loss,validation_accuracy\n");
  for (int epoch = 1; epoch <= epochs; ++epoch) {
    for (std::size_t i = order.size() - 1; i > 0; --i)
      std::swap(order[i], order[random() % (i + 1)]);
    double total = 0;
    const float rate =
        2e-3F * (1 - 0.9F * static_cast<float>(epoch - 1) / static_cast<float>(epochs));
    for (std::size_t begin = 0; begin + batch <= order.size(); begin += batch) {
      // Fixed lanes, summed in order: the same network for any thread count.
      std::array<cnn::Parameters, lanes> gradients{};
      std::array<double, lanes> losses{};
      parallel_for(lanes, [&](int lane) {
        const auto l = static_cast<std::size_t>(lane);
        for (std::size_t i = l; i < batch; i += lanes)
          losses[l] +=
              loss_of(parameters, train[static_cast<std::size_t>(order[begin + i])], &gradients[l]);
      });
      for (std::size_t l = 1; l < lanes; ++l) {
        losses[0] += losses[l];
        for (std::size_t i = 0; i < parameters.size(); ++i) gradients[0][i] += gradients[l][i];
      }
      for (float& g : gradients[0]) g /= batch;
      total += losses[0] / batch;
      adam.apply(parameters, gradients[0], rate);
    }
    int right = 0;
    for (const Pair& pair : validation) right += loss_of(parameters, pair, nullptr) < std::log(2.0);
    const std::size_t batches = order.size() / batch;
    fmt::print("{},{:.5f},{:.4f}\n", epoch, total / static_cast<double>(batches),
               right / static_cast<double>(validation.size()));
  }
  const Status written = write_file_atomic(argv[1], cnn::bytes_of(parameters));
  if (!written) fmt::print(stderr, "{}\n", written.error().message());
  return written ? 0 : 4;
}
