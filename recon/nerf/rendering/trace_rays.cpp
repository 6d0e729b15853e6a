// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/rendering/trace_rays.hpp"

#include <algorithm>
#include <limits>

#include "core/system/parallel.hpp"
#include "recon/nerf/device/on_device.hpp"
#include "recon/nerf/rendering/proposal.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr int traced_per_block = 64;

/// Ray r of a block, whose rows begin at `row`.
TracedRay read_ray(const FieldState& field, const RayBlock& block, std::size_t r,
                   const ForwardSettings& limits, int& row) {
  TracedRay out{};
  out.distance = std::numeric_limits<float>::quiet_NaN();
  out.forward = block.rays[r].forward;
  out.there = true;
  ray_value(field, block, static_cast<int>(r), row, out.value);
  const auto begin = static_cast<std::size_t>(block.first[r]);
  read_light(block.used[r], &block.t[begin], &block.dt[begin], &block.light[begin], limits.stop,
             limits.surface_light, out);
  return out;
}

void trace_on_processor(const FieldState& field, const ForwardSettings& limits,
                        const MarchSettings& march, int count, const RayOf& ray_of,
                        TracedRay* out) {
  const Kernels& kernels = kernels_for(best_isa());
  parallel_blocks(count, traced_per_block, [&](int begin, int end) {
    thread_local RayBlock block;
    thread_local ProposalBlock proposals;
    thread_local std::vector<DrawnRay> drawn;
    thread_local std::vector<int> index;
    block.clear();
    drawn.clear();
    index.clear();
    for (int i = begin; i < end; ++i) {
      out[i].there = false;
      DrawnRay ray;
      if (!ray_of(i, ray)) continue;
      drawn.push_back(ray);
      index.push_back(i);
    }
    if (drawn.empty()) return;
    if (field.options.sampling == Sampling::proposal)
      add_proposed(field, kernels, drawn, {.near = march.near}, proposals, block);
    else
      block.add(field.occupancy, march, drawn);
    forward(field, kernels, limits, block);
    int row = 0;
    for (std::size_t r = 0; r < index.size(); ++r)
      out[index[r]] = read_ray(field, block, r, limits, row);
  });
}

void trace_on_device(device::Engine& engine, const FieldState& field, const ForwardSettings& limits,
                     const MarchSettings& march, int count, const RayOf& ray_of, TracedRay* out) {
  std::vector<device::TraceRequest> rays(static_cast<std::size_t>(count));
  parallel_blocks(count, traced_per_block, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      DrawnRay ray;
      const bool there = ray_of(i, ray);
      rays[static_cast<std::size_t>(i)] = {ray.ray, ray.near, ray.far, there};
    }
  });
  field.device_copy.with([&] { return engine.tracer(device::shown_numbers(field)); },
                         [&](device::Tracer& tracer) {
                           tracer.trace(
                               rays.data(), count,
                               {march, limits.stop, limits.min_weight, limits.surface_light}, out);
                         });
}

}  // namespace

void trace_rays(const FieldState& field, const ForwardSettings& limits, const MarchSettings& march,
                int count, const RayOf& ray_of, TracedRay* out) {
  if (count == 0) return;
  device::Engine* engine = device::current();
  if (engine != nullptr && field.options.sampling == Sampling::occupancy)
    trace_on_device(*engine, field, limits, march, count, ray_of, out);
  else
    trace_on_processor(field, limits, march, count, ray_of, out);
}

}  // namespace orbitfuse::nerf
