// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/device/on_device.hpp"

#include <algorithm>

#include "recon/nerf/compute_device.hpp"

namespace orbitfuse::nerf::device {
namespace {

std::unique_ptr<Engine>& engine_in_use() {
  static std::unique_ptr<Engine> engine;
  return engine;
}

Numbers numbers_of(const Parameters& set) { return {set.value, set.first, set.second}; }

void take_back(Numbers&& numbers, Parameters& set) {
  set.value = std::move(numbers.value);
  set.first = std::move(numbers.first);
  set.second = std::move(numbers.second);
}

std::vector<LayerShape> shapes_of(const Mlp& network) {
  std::vector<LayerShape> shapes;
  for (const Mlp::Layer& layer : network.layers) shapes.push_back({layer.in, layer.out});
  return shapes;
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
  out.density_layers = shapes_of(field.main.mlp);
  out.color_layers = shapes_of(field.color);
  out.table.value = grid.table.values();
  out.density.value = field.main.mlp.weights.value;
  out.color.value = field.color.weights.value;
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
  out.table.first = table.part(&GridLine::first);
  out.table.second = table.part(&GridLine::second);
  out.density = numbers_of(field.main.mlp.weights);
  out.color = numbers_of(field.color.weights);
  out.offsets = numbers_of(field.image_offsets);
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
  take_back(std::move(numbers.density), field.main.mlp.weights);
  take_back(std::move(numbers.color), field.color.weights);
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

PoseSums sums_of(const ViewSums& sums) {
  PoseSums out;
  std::copy(std::begin(sums.normal), std::end(sums.normal), out.normal.begin());
  std::copy(std::begin(sums.right), std::end(sums.right), out.right.begin());
  out.rays = sums.rays;
  return out;
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
