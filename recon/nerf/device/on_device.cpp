// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/device/on_device.hpp"

#include <utility>

#include "recon/nerf/compute_device.hpp"

namespace orbitfuse::nerf::device {
namespace {

std::unique_ptr<Engine>& engine_in_use() {
  static std::unique_ptr<Engine> engine;
  return engine;
}

void take_back(Numbers&& numbers, Parameters& set) {
  set.value = std::move(numbers.value);
  set.first = std::move(numbers.first);
  set.second = std::move(numbers.second);
}

NetworkNumbers weights_of(const Mlp& network) {
  NetworkNumbers out;
  for (const Mlp::Layer& layer : network.layers)
    out.layers.push_back({layer.in, layer.out, static_cast<long>(layer.offset)});
  out.weights.value = network.weights.value;
  out.transposed = network.transposed;
  return out;
}

void add_moments(const Parameters& set, Numbers& to) {
  to.first = set.first;
  to.second = set.second;
}

}  // namespace

Engine* current() { return engine_in_use().get(); }
void use(std::unique_ptr<Engine> engine) { engine_in_use() = std::move(engine); }

FieldNumbers shown_numbers(const FieldState& field) {
  FieldNumbers out;
  out.channels = field.channels();
  out.bounded = field.modality == Modality::visible;
  out.sh_degree = field.options.sh_degree;
  const HashEncoding& grid = field.main.grid;
  out.levels = grid.levels;
  out.level_weight = grid.level_weight;
  out.features = grid.features;
  out.width = grid.width;
  out.half = grid.half;
  out.density = weights_of(field.main.mlp);
  out.color = weights_of(field.color);
  const Occupancy& cells = field.occupancy;
  out.resolution = cells.resolution;
  out.cascades = cells.cascades;
  out.on = cells.on;
  out.any = cells.any;
  out.plain = cells.plain;
  out.look = cells.look;
  return out;
}

FieldNumbers all_numbers(const FieldState& field) {
  FieldNumbers out = shown_numbers(field);
  const GridTable& table = field.main.grid.table;
  out.table = {table.values(), table.part(&GridLine::first), table.part(&GridLine::second)};
  add_moments(field.main.mlp.weights, out.density.weights);
  add_moments(field.color.weights, out.color.weights);
  const Parameters& offsets = field.image_offsets;
  out.offsets = {offsets.value, offsets.first, offsets.second};
  const Occupancy& cells = field.occupancy;
  out.allowed = cells.allowed;
  out.cell_density = cells.density;
  out.window = cells.window;
  return out;
}

void take_back(FieldNumbers numbers, FieldState& field) {
  GridTable& table = field.main.grid.table;
  table.set_values(numbers.table.value);
  table.set_part(&GridLine::first, numbers.table.first);
  table.set_part(&GridLine::second, numbers.table.second);
  take_back(std::move(numbers.density.weights), field.main.mlp.weights);
  take_back(std::move(numbers.color.weights), field.color.weights);
  take_back(std::move(numbers.offsets), field.image_offsets);
  Occupancy& cells = field.occupancy;
  cells.on = std::move(numbers.on);
  cells.density = std::move(numbers.cell_density);
  cells.window = std::move(numbers.window);
  cells.visited.clear();
  for (std::size_t cell = 0; cell < cells.window.size(); ++cell)
    if (cells.window[cell] >= 0) cells.visited.push_back(static_cast<std::int64_t>(cell));
  cells.refresh();
  field.refresh();
}

Error error_of(const Refused& refused) {
  return {ErrorKind::unavailable, "the CUDA device", refused.what, "run it with --device cpu"};
}

}  // namespace orbitfuse::nerf::device

namespace orbitfuse::nerf {

Result<std::string> use_cuda() {
  try {
    device::use(device::cuda_engine());
  } catch (const device::Refused& refused) {
    return tl::unexpected(device::error_of(refused));
  }
  return device::current()->name();
}

}  // namespace orbitfuse::nerf
