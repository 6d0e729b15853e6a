// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/nerf/device/adam.hpp"
#include "recon/nerf/device/grid.hpp"
#include "recon/nerf/device/layers.hpp"

// A device's kernels behind the processor's table of kernels, so that the tests which hold every
// instruction set to double precision hold a device to it, too. Each call copies there and back.
namespace orbitfuse::nerf::ORBITFUSE_ENGINE {

/// [row][feature] as the processor has it, by features; `features` may be padded with `stride`.
class Turned {
 public:
  Turned(const float* rows, int count, int features) : stride_((count + 3) / 4 * 4) {
    std::vector<float> turned(static_cast<std::size_t>(features) * stride());
    for (int r = 0; r < count && rows != nullptr; ++r)
      for (int f = 0; f < features; ++f)
        turned[static_cast<std::size_t>(f) * stride() + static_cast<std::size_t>(r)] =
            rows[static_cast<long>(r) * features + f];
    memory_.upload(turned);
  }
  Rows rows() const { return {memory_.data(), stride_}; }
  void back(float* rows, int count, int features, int row_stride) const {
    const std::vector<float> turned =
        memory_.download(static_cast<std::size_t>(features) * stride());
    for (int r = 0; r < count; ++r)
      for (int f = 0; f < features; ++f)
        rows[static_cast<long>(r) * row_stride + f] =
            turned[static_cast<std::size_t>(f) * stride() + static_cast<std::size_t>(r)];
  }

 private:
  std::size_t stride() const { return static_cast<std::size_t>(stride_); }
  long stride_;
  Buffer<float> memory_;
};

struct Counted {
  Buffer<int> memory;
  SampleCount count;
  explicit Counted(int n) : memory(std::vector<int>{n}), count{memory.data(), n} {}
};

inline Levels one_level(const GridLevel& level) {
  Levels out{};
  out.level[0] = level;
  out.level[0].offset = 0;
  out.weight[0] = 1;
  out.count = 1;
  out.features = level.features;
  return out;
}

inline void encode_level(const GridLevel& level, const std::uint16_t* half_table,
                         const float* position, int count, float* out, int stride) {
  if (count == 0) return;
  const std::size_t numbers = std::size_t{level.entries} * static_cast<std::size_t>(level.features);
  const Buffer<std::uint16_t> half(std::vector<std::uint16_t>(half_table, half_table + numbers));
  const Turned at(position, count, 3), features(nullptr, count, level.features);
  const Counted samples(count);
  if (level.features == 4)
    launch(count,
           Encode<4>{one_level(level), half.data(), at.rows(), samples.count, features.rows()});
  else
    launch(count,
           Encode<2>{one_level(level), half.data(), at.rows(), samples.count, features.rows()});
  features.back(out, count, level.features, stride);
}

inline void scatter_level(const GridLevel& level, GridLine* lines, std::uint64_t* touched,
                          const float* position, int count, const float* dfeatures) {
  if (count == 0) return;
  const std::size_t numbers = std::size_t{level.entries} * static_cast<std::size_t>(level.features);
  Buffer<long long> gradient;
  gradient.zeros(numbers);
  const Turned at(position, count, 3), d(dfeatures, count, level.features);
  const Counted samples(count);
  const Buffer<int> finite(std::vector<int>{1});
  if (level.features == 4)
    launch(count, Scatter<4>{one_level(level), at.rows(), samples.count, d.rows(), gradient.data(),
                             finite.data()});
  else
    launch(count, Scatter<2>{one_level(level), at.rows(), samples.count, d.rows(), gradient.data(),
                             finite.data()});
  const std::vector<long long> sums = gradient.download(numbers);
  for (std::size_t i = 0; i < numbers; ++i) {
    if (sums[i] == 0) continue;
    lines[i / 4].grad[i % 4] += value_of(sums[i]);
    touched[i / 256] |= std::uint64_t{1} << (i / 4 % 64);
  }
}

inline void apply_layer(int inputs, int outputs, const float* weights, int rows, const float* in,
                        float* out, Epilogue epilogue, const float* activation) {
  if (rows == 0) return;
  const Buffer<float> w(std::vector<float>(weights, weights + static_cast<long>(inputs) * outputs));
  const Turned x(in, rows, inputs), y(nullptr, rows, outputs), mask(activation, rows, outputs);
  const Counted samples(rows);
  launch(ApplyLayer::threads(outputs, rows),
         ApplyLayer{inputs, outputs, w.data(), x.rows(), y.rows(), samples.count, epilogue,
                    mask.rows()});
  y.back(out, rows, outputs, outputs);
}

inline void forward_layer(const LayerView& layer, int rows, const float* in, float* out,
                          bool relu) {
  apply_layer(layer.in, layer.out, layer.weights, rows, in, out,
              relu ? Epilogue::relu : Epilogue::store, nullptr);
}

inline void backward_layer(const LayerView& layer, int rows, const float* dout, float* din,
                           const float* activation) {
  apply_layer(layer.out, layer.in, layer.transposed, rows, dout, din,
              activation != nullptr ? Epilogue::mask : Epilogue::store, activation);
}

inline void weight_gradient(const LayerView& layer, int rows, const float* in, const float* dout,
                            float* dweights) {
  const int weights = layer.in * layer.out;
  const Turned x(in, rows, layer.in), d(dout, rows, layer.out);
  const Counted samples(rows);
  Buffer<float> partial, gradient;
  partial.need(static_cast<std::size_t>(weights) * weight_chunks);
  gradient.need(static_cast<std::size_t>(weights));
  const Buffer<int> finite(std::vector<int>{1});
  launch(WeightGradient::threads(layer.in, layer.out),
         WeightGradient{layer.in, layer.out, x.rows(), d.rows(), samples.count.counted,
                        partial.data()});
  launch(weights, SumChunks{weights, partial.data(), gradient.data(), finite.data()});
  const std::vector<float> sum = gradient.download(static_cast<std::size_t>(weights));
  for (std::size_t i = 0; i < sum.size(); ++i) dweights[i] += sum[i];
}

struct AdamNumbers {
  AdamStep step;
  Moments at;
  const float* gradient;
  float limit;
  ORBITFUSE_HOST_DEVICE void operator()(int i) const { adam_step(step, at, i, gradient[i], limit); }
};

inline void adam_numbers(const AdamStep& step, std::int64_t count, float* parameter, float* first,
                         float* second, float* grad) {
  const auto copy = [&](const float* from) { return std::vector<float>(from, from + count); };
  const Buffer<float> value(copy(parameter)), m(copy(first)), v(copy(second)), g(copy(grad));
  launch(static_cast<int>(count),
         AdamNumbers{step, {value.data(), m.data(), v.data()}, g.data(), no_limit});
  const auto bytes = static_cast<std::size_t>(count) * sizeof(float);
  copy_from(parameter, value.data(), bytes);
  copy_from(first, m.data(), bytes);
  copy_from(second, v.data(), bytes);
  std::memset(grad, 0, bytes);
}

inline void adam_table(const AdamStep& step, std::int64_t words, std::uint64_t* touched,
                       GridLine* lines, std::uint16_t* half) {
  for (std::int64_t line = 0; line < 64 * words; ++line) {
    if ((touched[line >> 6] >> (line & 63) & 1u) == 0) continue;
    GridLine& at = lines[line];
    long long fixed[4];
    for (int i = 0; i < 4; ++i) fixed[i] = fixed_of(at.grad[i]);
    Buffer<long long> gradient(std::vector<long long>(fixed, fixed + 4));
    const Buffer<float> value(std::vector<float>(at.value, at.value + 4)),
        m(std::vector<float>(at.first, at.first + 4)),
        v(std::vector<float>(at.second, at.second + 4));
    std::vector<std::uint16_t> before;  // a device keeps both copies alike
    for (const float number : at.value) before.push_back(half_of(number));
    const Buffer<std::uint16_t> halves(before);
    const Buffer<int> finite(std::vector<int>{1});
    launch(4, AdamTable{step,
                        {value.data(), m.data(), v.data()},
                        gradient.data(),
                        halves.data(),
                        finite.data()});
    copy_from(at.value, value.data(), sizeof(at.value));
    copy_from(at.first, m.data(), sizeof(at.first));
    copy_from(at.second, v.data(), sizeof(at.second));
    copy_from(half + 4 * line, halves.data(), 4 * sizeof(std::uint16_t));
    for (float& g : at.grad) g = 0;
    touched[line >> 6] &= ~(std::uint64_t{1} << (line & 63));
  }
}

inline Kernels as_kernels() {
  return {Isa::avx2,      encode_level,    scatter_level, forward_layer,
          backward_layer, weight_gradient, adam_numbers,  adam_table};
}

}  // namespace orbitfuse::nerf::ORBITFUSE_ENGINE
