// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "recon/nerf/field/draw_rules.hpp"
#include "recon/nerf/field/march_settings.hpp"
#include "recon/nerf/field/pose_sums.hpp"
#include "recon/nerf/field/ray.hpp"
#include "recon/nerf/field/ray_numbers.hpp"
#include "recon/nerf/field/traced_ray.hpp"
#include "recon/nerf/kernels/kernels.hpp"

// What a device does for a field: its training steps, and what rays show. Plain numbers and C++17,
// because nvcc reads this. Fields with Sampling::proposal stay on the processor.
namespace orbitfuse::nerf::device {

/// Trainable numbers with Adam's moments; of the hash table, a perceptron or the views' offsets.
struct Numbers {
  std::vector<float> value, first, second;
};

struct DenseLayer {
  int inputs, outputs;
  long offset;  ///< of its weights among the network's
};

/// A perceptron (Mlp).
struct NetworkNumbers {
  std::vector<DenseLayer> layers;
  Numbers weights;
  std::vector<float> transposed;
};

/// A field as a device takes it and gives it back.
struct FieldNumbers {
  int channels = 3;
  bool bounded = true;  ///< colours: a sigmoid; temperatures: none
  int sh_degree = 0;
  std::vector<GridLevel> levels;
  std::vector<float> level_weight;
  int features = 4, width = 32;
  std::vector<std::uint16_t> half;  ///< the table as rendering reads it
  NetworkNumbers density, color;
  Numbers table, offsets;
  int resolution = 0, cascades = 0;  ///< of the occupancy, whose arrays follow (Occupancy)
  std::vector<std::uint64_t> on, allowed, any, plain;
  std::vector<std::uint8_t> look;
  std::vector<float> cell_density, window;
};

/// One view that may train; pointers are read once, as are those of the tiles.
struct Photo {
  RayNumbers rays;
  const float* lattice = nullptr;   ///< [rows][columns][2]
  const float* target = nullptr;    ///< [height][width][channels]
  const float* distance = nullptr;  ///< [height][width]
  const std::int32_t* known = nullptr;
  std::int64_t known_count = 0;
  const std::uint8_t* clearance_px = nullptr;  ///< may be null
  bool trains = true;
};

/// What one step does.
struct StepPlan {
  int step = 0, rays = 0;
  std::uint64_t first_ray = 0;  ///< rays of the steps before
  std::uint64_t seed = 0;
  float supervision = 0;  ///< weight of the depth loss
  bool posing = false;    ///< note by how much the views' pictures differ
  float per_ray = 1, distortion_weight = 0, huber = 0;
  MarchSettings march;
  AdamStep grid, network, offsets;
  bool with_offsets = false;
};

struct StepOutcome {
  long rays = 0, samples = 0, channels = 0;
  double squared_error = 0;
  bool finite = true;
};

/// A field in training. Every function throws Refused.
class Steps {
 public:
  virtual ~Steps() = default;
  virtual StepOutcome step(const StepPlan& plan) = 0;
  virtual void set_level_weight(const std::vector<float>& weight) = 0;
  /// Looks at cells beside occupied ones, then Occupancy::update().
  virtual void update_occupancy(int step, std::uint64_t seed, float decay, float threshold) = 0;
  /// What the views' rays have said since the last call; one a view.
  virtual std::vector<PoseSums> take_pose_sums() = 0;
  virtual void place(int view, const RayNumbers& rays) = 0;
  /// Parameters, moments and what occupancy goes by (on, cell_density, window), as they are now.
  virtual FieldNumbers fetch() = 0;
};

struct TraceRequest {
  Ray ray;
  float near, far;
  bool there;
};

struct TraceSettings {
  MarchSettings march;
  float stop, min_weight, surface_light;
};

/// A finished field. Throws Refused.
class Tracer {
 public:
  virtual ~Tracer() = default;
  virtual void trace(const TraceRequest* rays, int count, const TraceSettings& settings,
                     TracedRay* out) = 0;
};

/// The device would not do it, in its own words: no memory, mostly.
struct Refused {
  std::string what;
};

/// What one kernel took, of all its launches.
struct KernelTime {
  std::string name;
  long launches = 0;
  double seconds = 0;
};

class Engine {
 public:
  virtual ~Engine() = default;
  virtual std::string name() const = 0;
  virtual std::unique_ptr<Steps> steps(const FieldNumbers& field, const std::vector<Photo>& photos,
                                       const PixelTilesView& tiles) = 0;
  virtual std::unique_ptr<Tracer> tracer(const FieldNumbers& field) = 0;
  /// Its kernels one by one, for tests: each call copies there and back.
  virtual Kernels kernels() const = 0;
  /// For benchmarks: from here on each kernel is waited for and its time noted.
  virtual void time_kernels() = 0;
  virtual std::vector<KernelTime> kernel_times() const = 0;
};

/// The first CUDA device. Throws Refused: there is none, or it can't be used.
std::unique_ptr<Engine> cuda_engine();

}  // namespace orbitfuse::nerf::device
