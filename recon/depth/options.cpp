// SPDX-License-Identifier: BSD-3-Clause
#include "recon/depth/options.hpp"

#include <fmt/format.h>

namespace orbitfuse::depth {

Status DepthOptions::validate() const {
  const auto bad = [](const char* field, auto value, const char* remedy) {
    return fail(ErrorKind::usage, fmt::format("depth.{}", field), fmt::format("{}", value), remedy);
  };
  if (width_px < 32 || width_px > 8192) return bad("width_px", width_px, "choose 32..8192");
  if (neighbours < 1 || neighbours > 16) return bad("neighbours", neighbours, "choose 1..16");
  if (best_neighbours < 1 || best_neighbours > neighbours)
    return bad("best_neighbours", best_neighbours, "choose 1..neighbours");
  if (!(max_angle_deg > 0 && max_angle_deg <= 90))
    return bad("max_angle_deg", max_angle_deg, "choose above 0, up to 90");
  if (!(min_angle_deg >= 0 && min_angle_deg < max_angle_deg))
    return bad("min_angle_deg", min_angle_deg, "choose 0..max_angle_deg");
  if (coarse_iterations < 0 || coarse_iterations > 100)
    return bad("coarse_iterations", coarse_iterations, "choose 0..100");
  if (fine_iterations < 0 || fine_iterations > 100)
    return bad("fine_iterations", fine_iterations, "choose 0..100");
  if (!(max_cost > 0 && max_cost < 1)) return bad("max_cost", max_cost, "choose between 0 and 1");
  if (!(agreement > 0 && agreement < 1)) return bad("agreement", agreement, "choose 0..1");
  if (!(agreement_px > 0)) return bad("agreement_px", agreement_px, "choose above 0");
  if (min_agreeing < 1 || min_agreeing > neighbours)
    return bad("min_agreeing", min_agreeing, "choose 1..neighbours");
  return {};
}

}  // namespace orbitfuse::depth
