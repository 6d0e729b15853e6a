// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/nerf/device/shade.hpp"
#include "recon/nerf/field/occupancy_codes.hpp"

// Which cells may hold matter, kept up on the device as Occupancy::record() and update() do.
namespace orbitfuse::nerf::ORBITFUSE_ENGINE {

struct CellStore {
  int resolution, cascades;
  std::uint64_t *on, *any, *plain;
  const std::uint64_t* allowed;
  float *density, *window;
  std::uint8_t* look;
  const float* code_least;  ///< CodeThresholds

  ORBITFUSE_HOST_DEVICE float size_of(int cascade) const {
    return 2.0f * static_cast<float>(1 << cascade) / static_cast<float>(resolution);
  }
  ORBITFUSE_HOST_DEVICE long cell_of(int cascade, const float x[3]) const {
    const float per_cell = 0.5f * static_cast<float>(resolution) / static_cast<float>(1 << cascade);
    return address_of(resolution, cascade, per_cell, x).index();
  }
  ORBITFUSE_HOST_DEVICE void center_of(long at, float x[3]) const {
    const int blocks = resolution / 4;
    long block = at >> 6;
    int i[3];
    for (int d = 0; d < 3; ++d, block /= blocks)
      i[d] = static_cast<int>(block % blocks) * 4 + static_cast<int>(at >> (2 * d) & 3);
    const int cascade = static_cast<int>(block);
    for (int d = 0; d < 3; ++d)
      x[d] =
          (static_cast<float>(i[d]) + 0.5f) * size_of(cascade) - static_cast<float>(1 << cascade);
  }
  ORBITFUSE_HOST_DEVICE void record(const float x[3], float sigma) const {
    const int cascade = cascade_of(x);
    if (cascade < cascades && sigma >= 0) raise_to(window + cell_of(cascade, x), sigma);
  }
};

/// The density that light sees along the step's rays.
struct RecordRays {
  const DeviceRay* rays;
  RaySamples samples;
  Light light;
  CellStore cells;
  const int* finite;  ///< else nothing changes

  ORBITFUSE_HOST_DEVICE void operator()(int r) const {
    if (!rays[r].there || *finite == 0) return;
    const int begin = samples.first[r];
    const Ray& ray = rays[r].ray;
    for (int i = begin; i < begin + light.used[r]; ++i) {
      float x[3];
      for (int d = 0; d < 3; ++d) x[d] = ray.origin[d] + samples.t[i] * ray.direction[d];
      cells.record(x, (i > begin ? light.left[i - 1] : 1.0f) * light.sigma[i]);
    }
  }
};

/// A cell that is off beside one that is on, drawn as Trainer::probe_cells() does.
struct DrawProbes {
  CellStore cells;
  std::uint64_t seed;
  int step;
  Four* position;
  int* there;

  ORBITFUSE_HOST_DEVICE void operator()(int i) const {
    there[i] = 0;
    constexpr std::uint64_t draws = occupancy_probes * probe_attempts;
    const std::uint64_t bits = random_bits(
        seed, probe_stream, static_cast<std::uint64_t>(step) * draws + static_cast<unsigned>(i));
    const long per_cascade =
        static_cast<long>(cells.resolution) * cells.resolution * cells.resolution;
    const auto cell =
        static_cast<long>(bits % static_cast<std::uint64_t>(per_cascade * cells.cascades));
    if (!bit_of(cells.on, cell)) return;
    float x[3];
    cells.center_of(cell, x);
    for (int d = 0; d < 3; ++d)
      x[d] += cells.size_of(static_cast<int>(cell / per_cascade)) * 3.0f *
              (uniform01(random_bits(bits, 7, static_cast<unsigned>(d))) - 0.5f);
    const int at = cascade_of(x);
    if (at >= cells.cascades || bit_of(cells.on, cells.cell_of(at, x))) return;
    position[i] = {{x[0], x[1], x[2], 0}};
    there[i] = 1;
  }
};

/// The first occupancy_probes of them.
struct ListProbes {
  const Four* position;
  const int *there, *first;
  Four* chosen;
  Rows position01;
  int* count;

  ORBITFUSE_HOST_DEVICE void operator()(int i) const {
    constexpr int last = occupancy_probes * probe_attempts - 1;
    if (i == last) {
      const int all = first[i] + there[i];
      *count = all < occupancy_probes ? all : occupancy_probes;
    }
    if (there[i] == 0 || first[i] >= occupancy_probes) return;
    const int to = first[i];
    chosen[to] = position[i];
    float contracted[3];
    contract01(position[i].v, contracted);
    for (int d = 0; d < 3; ++d) position01(d, to) = contracted[d];
  }
};

struct RecordProbes {
  const Four* chosen;
  const int* counted;
  Rows density;
  CellStore cells;

  ORBITFUSE_HOST_DEVICE void operator()(int i) const {
    if (i < *counted) cells.record(chosen[i].v, density_of(density(0, i)));
  }
};

/// Sums over visited cells; opacity in parts of 2^-32.
struct VisitSums {
  long long opacity, cells;
};
constexpr double opacity_unit = 1.0 / (1ull << 32);

struct FadeCells {
  CellStore cells;
  float decay;
  VisitSums* sums;

  ORBITFUSE_HOST_DEVICE void operator()(int cell) const {
    const float seen = cells.window[cell];
    if (seen < 0) return;
    const float faded = cells.density[cell] * decay, value = seen > faded ? seen : faded;
    cells.density[cell] = value;
    const int per_cascade = cells.resolution * cells.resolution * cells.resolution;
    const float opacity = value * cells.size_of(cell / per_cascade);
    add_to(&sums->opacity, static_cast<long long>((opacity < 1 ? opacity : 1.0f) / opacity_unit));
    add_to(&sums->cells, 1);
  }
};

/// Visited cells stay on while their opacity is at least min(threshold, half the mean): a thread a
/// block of 64 cells.
struct SwitchCells {
  CellStore cells;
  float threshold;
  const VisitSums* sums;

  ORBITFUSE_HOST_DEVICE void operator()(int block) const {
    const long first = static_cast<long>(block) * 64;
    bool visited = false;
    for (int k = 0; k < 64 && !visited; ++k) visited = cells.window[first + k] >= 0;
    if (!visited) return;
    const auto mean = static_cast<float>(0.5 * static_cast<double>(sums->opacity) * opacity_unit /
                                         static_cast<double>(sums->cells));
    const float limit = threshold < mean ? threshold : mean;
    const long per_cascade =
        static_cast<long>(cells.resolution) * cells.resolution * cells.resolution;
    const float size = cells.size_of(static_cast<int>(first / per_cascade));
    std::uint64_t on = cells.on[block];
    bool coded = false;
    for (int k = 0; k < 64; ++k) {
      const long cell = first + k;
      const std::uint64_t bit = std::uint64_t{1} << k;
      const float density = cells.density[cell];
      const int code = code_by(cells.code_least, density);
      coded = coded || code > 0;
      if (cells.window[cell] < 0) continue;
      cells.window[cell] = -1;
      const bool stays = (cells.allowed[block] & bit) != 0 && density * size >= limit;
      on = stays ? on | bit : on & ~bit;
      cells.look[cell] = static_cast<std::uint8_t>(stays ? 1 + (code < 254 ? code : 254) : 0);
    }
    cells.on[block] = on;
    put_bit(cells.any, block, on != 0);
    put_bit(cells.plain, block, on == ~std::uint64_t{0} && !coded);
  }
};

}  // namespace orbitfuse::nerf::ORBITFUSE_ENGINE
