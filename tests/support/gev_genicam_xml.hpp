// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

namespace orbitfuse::testing {

/// Where the simulator keeps its features (manufacturer area of the register map).
namespace gev_registers {
inline constexpr std::uint32_t width = 0xa000, height = 0xa004, pixel_format = 0xa008,
                               payload_size = 0xa00c, acquisition_mode = 0xa010, start = 0xa014,
                               stop = 0xa018, ir_format = 0xa01c, ir_frame_rate = 0xa020,
                               nuc_action = 0xa024, nuc_mode = 0xa028, planck_r = 0xa030,
                               planck_b = 0xa034, planck_f = 0xa038, j0 = 0xa03c, j1 = 0xa040,
                               emissivity = 0xa044, reflected_k = 0xa048, frame_rate = 0xa04c;
}  // namespace gev_registers

/// A GenICam description in the manner of a radiometric FLIR camera, written for this project.
std::string gev_genicam_xml();

}  // namespace orbitfuse::testing
