// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "recon/registration/register.hpp"

namespace orbitfuse {

const char* name_of(WarpOutcome outcome) {
  switch (outcome) {
    case WarpOutcome::not_asked:
      return "not_asked";
    case WarpOutcome::too_little:
      return "too_little";
    case WarpOutcome::none:
      return "none";
    case WarpOutcome::found:
      return "found";
    case WarpOutcome::at_limit:
      return "at_limit";
    case WarpOutcome::diverged:
      return "diverged";
  }
  return "";
}

std::string RegistrationReport::brief() const {
  std::string text = fmt::format(
      "score {:.2f} (evidence {:.2f}) by {}; overlap {:.0f} % of the source, {:.0f} % of the "
      "target; rmse {:.2f} % of the "
      "diameter; scale {:.5g}; spread {:.2f} deg, {:.2f} %",
      score, evidence, initialiser, 100 * overlap_source, 100 * overlap_target,
      rmse_percent_of_diameter, target_from_source.scale, spread_rotation_deg,
      spread_scale_percent);
  if (warp_percent_of_diameter > 0)
    text += fmt::format("; smooth warp of {:.2f} % left out", warp_percent_of_diameter);
  if (ambiguous) text += "; AMBIGUOUS: " + ambiguity;
  return text;
}

}  // namespace orbitfuse
