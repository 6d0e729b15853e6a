// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

#include "recon/nerf/device/field_store.hpp"

namespace orbitfuse::nerf::ORBITFUSE_ENGINE {

constexpr int rays_per_batch = 1 << 13;  ///< 0.6 GB of stretches and activations

class FieldTracer final : public device::Tracer {
 public:
  explicit FieldTracer(const device::FieldNumbers& field) : field_(field) {}

  void trace(const device::TraceRequest* wanted, int count, const device::TraceSettings& settings,
             TracedRay* out) override {
    for (int begin = 0; begin < count; begin += rays_per_batch) {
      const int n = count - begin < rays_per_batch ? count - begin : rays_per_batch;
      rays_.clear();
      for (int i = begin; i < begin + n; ++i) {
        DeviceRay ray{};
        ray.ray = wanted[i].ray;
        ray.near = wanted[i].near;
        ray.far = wanted[i].far;
        ray.jitter = 0.5f;
        ray.there = wanted[i].there;
        rays_.push_back(ray);
      }
      pass_.rays.upload(rays_);
      pass_.run(field_, n, settings.march, settings.stop, settings.min_weight);
      traced_.need(static_cast<std::size_t>(n));
      launch(n, ReadRays{pass_.shown(field_), settings.stop, settings.surface_light,
                         std::numeric_limits<float>::quiet_NaN(), traced_.data()});
      copy_from(out + begin, traced_.data(), static_cast<std::size_t>(n) * sizeof(TracedRay));
    }
  }

 private:
  FieldStore field_;
  ForwardPass pass_;
  std::vector<DeviceRay> rays_;
  Buffer<TracedRay> traced_;
};

}  // namespace orbitfuse::nerf::ORBITFUSE_ENGINE
